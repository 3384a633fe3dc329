//! A scan that the map refuses: that of a cart which believes to be where it is not.

use std::fmt;
use std::fmt::Display;

use mrol::console::{CliError, percent};
use mrol_client::Client;
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::{MapName, RobotName};
use mrol_map::mapping::Guess;
use mrol_service::{ScanAnswer, ScanRequest};

const ROBOT: &str = "cart";
/// Points of the scan, and the half cylinder that they lie on: it is nowhere in the building.
const POINTS: u32 = 3000;
const RADIUS_M: f64 = 1.2;
const HEIGHT_M: f64 = 1.6;
/// Where the cart believes to be: in the corridor.
const GUESS_M: [f64; 3] = [7.0, 4.6, 1.0];

/// The answer to the cart's scan.
pub(super) struct Stray(ScanAnswer);

impl Stray {
    /// Sends the scan.
    pub(super) async fn send(client: &Client, map: &MapName) -> Result<Self, CliError> {
        let [x, y, z] = GUESS_M;
        let scan = ScanRequest {
            guess: Guess::Pose(Pose::translation(x, y, z)),
            ..ScanRequest::new(RobotName::new(ROBOT).map_err(CliError::failed)?, points().into())
        };
        Ok(Self(client.insert_scan(map, scan).await?))
    }

    pub(super) fn is_refused(&self) -> bool {
        !self.0.accepted
    }
}

impl Display for Stray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ScanAnswer { accepted, verdict, level_overlaps, .. } = &self.0;
        let overlap = percent(level_overlaps.first().copied().unwrap_or_default());
        let is = if *accepted { "accepted" } else { "refused" };
        write!(
            f,
            "a scan of {ROBOT} that shows another place was {is}: {}, overlap {overlap}",
            verdict.as_str()
        )
    }
}

/// Points that are spread evenly over the half cylinder.
fn points() -> Vec<Point> {
    let share = |i: u32, step: f64| (f64::from(i) * step).fract();
    let point = |i| {
        let turn = share(i, 0.618) * std::f64::consts::PI;
        [RADIUS_M * turn.cos(), RADIUS_M * turn.sin(), (share(i, 0.4142) - 0.5) * HEIGHT_M]
            .map(|value| value as f32)
            .into()
    };
    (0..POINTS).map(point).collect()
}
