//! Text on where to look next.

use mrol::console::Serving;

/// Name of the map that the robots build.
pub(super) const MAP: &str = "demo";

/// The link to the page that shows the demonstration's map.
pub(crate) fn page(serving: &Serving) -> String {
    format!("{}#map={MAP}", serving.page())
}

/// Commands that look around in the demonstration's daemon, and where to read on.
pub(super) fn text(serving: &Serving, once: bool) -> String {
    let (Serving { http, grpc, .. }, page) = (serving, page(serving));
    let lead = match once {
        true => "Without --once the daemon stays up for a look around:",
        false => "Look around, in another terminal:",
    };
    format!(
        r#"
See the map: {page}

{lead}
  curl http://{http}/v1/maps/demo
  curl -H 'content-type: application/json' -d '{{"points":[[4.6,9.0,1.0],[4.6,6.9,1.0]]}}' http://{http}/v1/maps/demo/occupancy
  curl http://{http}/metrics
  grpcurl -plaintext -d '{{"map":"demo","robot":"lidar"}}' {grpc} mrol.v1.Mapping/GetTrajectory
  mrol maps show demo --server http://{grpc}
  cargo run --release --example planner -- http://{grpc} demo
  mrol delete --map demo --sphere "4.6 9 1 0.5" --server http://{grpc}
Then: README.md, "Five-minute tour"; `mrol serve --help`; your own scans with `mrol map --help`."#
    )
}
