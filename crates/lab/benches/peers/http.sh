#!/usr/bin/env bash
# Batch queries over HTTP by clients that nobody here wrote, wrk and h2load (Debian: wrk, nghttp2-client):
# crates/lab/benches/peers/http.sh [SERVER]. Server and clients share the machine; server and points are the same each time.
set -euo pipefail
server=$(realpath "${1:-target/release/mrol}")
work=$(mktemp -d)
cd "$work"
"$server" --json serve --data-dir data --http-listen 127.0.0.1:0 --grpc-listen 127.0.0.1:0 >serving 2>log &
pid=$!
trap 'kill "$pid"; wait "$pid" || true; rm -rf "$work"' EXIT
until [ -s serving ]; do sleep 0.1; done
url=http://$(python3 -c 'import json; print(json.load(open("serving"))["http"])')/v1/maps/a

# A hall of 20 x 20 x 3 m in voxels of 5 cm, and points at random in it.
python3 - "$url" <<'END'
import random, struct, sys, urllib.request
url = sys.argv[1]
random.seed(1)
def ask(method, path, body, kind):
    urllib.request.urlopen(urllib.request.Request(url + path, body, {"content-type": kind}, method=method)).read()
packed = lambda points: b"".join(struct.pack("<3f", *point) for point in points)
meters = lambda most: random.uniform(0, most)
floor = [(meters(20), meters(20), 0.0) for _ in range(100_000)]
walls = [(random.choice((0, 20)), meters(20), meters(3)) for _ in range(100_000)]
ask("PUT", "", b'{"resolution_m": 0.05}', "application/json")
ask("POST", "/scans?robot=r&align=false&guess=0,0,0,0,0,0,1", packed(floor + walls), "application/octet-stream")
for count in (100, 10_000):
    with open(f"{count}", "wb") as file:
        file.write(packed((meters(20), meters(20), meters(3)) for _ in range(count)))
END
cat >post.lua <<'END'
wrk.method = "POST"
wrk.headers["content-type"] = "application/octet-stream"
wrk.body = io.open(os.getenv("POINTS"), "rb"):read("*a")
END
for points in 100 10000; do
    for connections in 1 8; do
        echo "== $points points a request, $connections connections: wrk"
        POINTS=$points wrk --threads 1 --connections "$connections" --duration 8s --latency --script post.lua "$url/occupancy" |
            grep -E "50%|99%|Requests/sec|Non-2xx"
        echo "== h2load"
        h2load --h1 --duration 8 --clients "$connections" --threads 1 --data "$points" \
            --header 'content-type: application/octet-stream' "$url/occupancy" | grep -E "finished|time for request|status"
    done
done
