"""Asks a real Prometheus, which looks at a server under load, what the dashboard and the alert rules ask it.

Usage: check.py SERVER FOLDER. Grafana itself does not run here: its files are checked for what they have to say."""

import json
import os
import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.parse
import urllib.request
from contextlib import contextmanager, nullcontext
from pathlib import Path

from load import node_of_a_cluster, server_under_load

DOCKER = Path(__file__).resolve().parent.parent
DASHBOARD = DOCKER / "grafana/dashboards/mrol.json"
# The last answer of a scrape has to be there, and rates take two of them.
DATA_WITHIN_S = 75
# What the load and the state of the server let fire at once.
FIRING = {"MrolMapUnavailable", "MrolCertificateExpires"}
# What a node of a cluster says alone.
OF_NODES = re.compile(r"mrol_(node|cluster)_|mrol_map_(leads|epoch|lag_revisions|parted)")


def main(binary, folder, binary_of_node):
    panels, variables = panels_of_dashboard()
    rules = (DOCKER / "prometheus/rules.yml").read_text()
    check_rules_are_tested(rules)
    nats = os.environ.get("NATS_SERVER_PROGRAM")
    with (
        server_under_load(binary, folder) as (server, load),
        node_of_a_cluster(binary_of_node, nats, server) if nats else nullcontext() as node,
        prometheus(server, node, Path(folder)) as ask,
    ):
        asked = [(f"panel {panel}", *target) for panel, targets in panels.items() for target in targets]
        asked += [(f"variable {name}", f"{metric}", [label]) for name, metric, label in variables]
        asked += [(f"rule {name}", with_bool(query), []) for name, query in rules_in_force(ask, rules)]
        if not nats:
            asked, of_nodes = [of for of in asked if not OF_NODES.search(of[1].split(" unless ")[0])], asked
            print(f"SKIPPED: {len(of_nodes) - len(asked)} expressions of a cluster, without NATS_SERVER_PROGRAM")
        wait_for_data(ask, asked, load)
        wait_for_alerts(ask)
    print(f"{len(panels)} panels and {rules.count('- alert:')} rules: {len(asked)} expressions, all with data")


def panels_of_dashboard():
    """The expressions of each panel with the labels that their legends name; and the variables."""
    dashboard = json.loads(DASHBOARD.read_text())
    uid = re.search(r"^\s+uid: (\S+)$", (DOCKER / "grafana/provisioning/datasources/prometheus.yml").read_text(), re.M)[1]
    ids, titles, panels = set(), set(), {}
    for panel in dashboard["panels"]:
        title = panel["title"]
        check(panel["id"] not in ids, f"panel {title}: the id {panel['id']} is taken")
        check(title and title not in titles, f"panel {title!r}: no title, or one that is taken")
        ids.add(panel["id"])
        titles.add(title)
        place = panel["gridPos"]
        check(place["x"] + place["w"] <= 24, f"panel {title}: wider than the page")
        if panel["type"] == "row":
            continue
        check(panel["description"], f"panel {title}: no description")
        check(panel["fieldConfig"]["defaults"]["unit"], f"panel {title}: no unit")
        check(panel["datasource"]["uid"] == uid, f"panel {title}: the data source is not {uid}")
        references = [target["refId"] for target in panel["targets"]]
        check(references and len(set(references)) == len(references), f"panel {title}: refIds {references}")
        panels[title] = [
            (chosen(target["expr"]), re.findall(r"{{(\w+)}}", target["legendFormat"])) for target in panel["targets"]
        ]
    check_places(dashboard["panels"])
    variables = []
    for variable in dashboard["templating"]["list"]:
        check(variable["datasource"]["uid"] == uid, f"variable {variable['name']}: the data source is not {uid}")
        metric, label = re.fullmatch(r"label_values\((.*), (\w+)\)", variable["query"]["query"]).groups()
        variables.append((variable["name"], chosen(metric), label))
    return panels, variables


def check_places(panels):
    """No two panels may lie on each other."""
    taken = {}
    for panel in panels:
        place = panel["gridPos"]
        for x in range(place["x"], place["x"] + place["w"]):
            for y in range(place["y"], place["y"] + place["h"]):
                other = taken.setdefault((x, y), panel["title"])
                check(other == panel["title"], f"panel {panel['title']} lies on {other}")


def chosen(expression):
    """The expression with what Grafana puts in place of its variables where everything is chosen."""
    expression = expression.replace("$__rate_interval", "1m")
    for variable in ("$instance", "$map"):
        expression = expression.replace(variable, ".*")
    check("$" not in expression, f"{expression}: a variable that the dashboard does not have")
    return expression


def with_bool(rule):
    """The rule with comparisons that answer 0 or 1, and leave no series out: it has data where its parts have."""
    # Strings and the matchers of labels in braces are no comparisons.
    parts = re.split(r'({[^}]*}|"[^"]*")', rule)
    parts[::2] = [re.sub(r"(==|!=|<=|>=|<|>)", r"\1 bool ", part) for part in parts[::2]]
    return "".join(parts)


def rules_in_force(ask, text):
    """Names and expressions of the rules, as Prometheus took them."""
    groups = ask("rules")["groups"]
    rules = [(rule["name"], rule["query"]) for group in groups for rule in group["rules"]]
    check(len(rules) == text.count("- alert:"), f"{len(rules)} rules in force")
    for name, query in rules:
        check(with_bool(query) != query, f"rule {name} compares nothing")
    return rules


def check_rules_are_tested(rules):
    """Each rule has a test in which it is quiet and one in which it fires."""
    tests = (DOCKER / "prometheus/rules_test.yml").read_text()
    guide = (DOCKER.parent / "docs/guide/operations.md").read_text()
    for name in re.findall(r"- alert: (\w+)", rules):
        quiet = re.search(rf"alertname: {name}\n +exp_alerts: \[\]", tests)
        fires = re.search(rf"alertname: {name}\n +exp_alerts:\n +- exp_labels", tests)
        check(quiet and fires, f"rule {name}: rules_test.yml has no test in which it is quiet, or none in which it fires")
        check(f"`{name}`" in guide, f"rule {name}: docs/guide/operations.md does not say what to do")


@contextmanager
def prometheus(server, node, folder):
    """A Prometheus with the repository's own configuration for keys; but for where the servers are, and how often it asks."""
    changed = (DOCKER / "prometheus/with-key.yml").read_text()
    for old, new in {
        '"mrol:7333"': ", ".join(f'"{address}"' for address in (server.address, node) if address),
        "/run/secrets/prometheus": str(folder / "prometheus.key"),
        "rules.yml": str(DOCKER / "prometheus/rules.yml"),
        ": 15s": ": 1s",
        "    metrics_path:": f"    scheme: https\n    tls_config: {{ ca_file: {server.certificate} }}\n    metrics_path:",
    }.items():
        check(old in changed, f"with-key.yml has no {old!r}")
        changed = changed.replace(old, new)
    (folder / "prometheus.yml").write_text(changed)
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = "127.0.0.1:%d" % free.getsockname()[1]
    options = ["--config.file", folder / "prometheus.yml", "--storage.tsdb.path", folder / "metrics"]
    log = folder / "prometheus.log"
    with log.open("w") as file:
        process = subprocess.Popen(["prometheus", *options, "--web.listen-address", address], stdout=file, stderr=file)
    try:
        ask = asking(f"http://{address}/api/v1/")
        deadline = time.monotonic() + 30
        while not is_ready(f"http://{address}/-/ready"):
            if process.poll() is not None or time.monotonic() > deadline:
                sys.exit(f"Prometheus does not start:\n{log.read_text()}")
            time.sleep(0.2)
        yield ask
    finally:
        process.terminate()
        process.wait()


def is_ready(url):
    try:
        return urllib.request.urlopen(url, timeout=5).status == 200
    except OSError:
        return False


def asking(root):
    """A function that asks Prometheus; what it does not understand ends the check."""

    def ask(path, **parameters):
        url = root + path + "?" + urllib.parse.urlencode(parameters)
        try:
            return json.load(urllib.request.urlopen(url, timeout=30))["data"]
        except urllib.error.HTTPError as error:
            sys.exit(f"{path} {parameters}: {error.read().decode()}")

    return ask


def wait_for_data(ask, asked, load):
    """Every expression answers with data, numbers among it, that have the labels which legends name."""
    deadline = time.monotonic() + DATA_WITHIN_S
    while without := [of for of in asked if not has_data(ask, *of)]:
        load.must_be_well()
        if time.monotonic() > deadline:
            sys.exit("without data:\n" + "\n".join(f"  {who}: {expression}" for who, expression, _ in without))
        time.sleep(1)


def has_data(ask, who, expression, labels):
    series = ask("query", query=expression)["result"]
    for one in series:
        missing = set(labels) - set(one["metric"])
        check(not missing, f"{who}: {expression} has no label {missing}")
    return any(one["value"][1] != "NaN" for one in series)


def wait_for_alerts(ask):
    """What has to fire fires, with its texts; nothing else does that waits for no time."""
    deadline = time.monotonic() + 30
    while True:
        alerts = ask("alerts")["alerts"]
        firing = {alert["labels"]["alertname"] for alert in alerts if alert["state"] == "firing"}
        if firing == FIRING:
            break
        if time.monotonic() > deadline:
            sys.exit(f"{firing} fire, and {FIRING} should")
        time.sleep(1)
    for alert in alerts:
        summary = alert["annotations"]["summary"]
        check("<no value>" not in summary and "error" not in summary, f"{alert['labels']}: {summary}")


def check(holds, message):
    if not holds:
        sys.exit(message)


if __name__ == "__main__":
    main(*sys.argv[1:])
