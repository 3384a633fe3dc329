//! A step of the explorer: to the nearest frontier that it can get to.

use super::frontier_explorer::Explorer;
use super::goal::Goal;
use super::ways::Ways;
use mrol_client::ClientError;
use mrol_map::geometry::pose_difference;
use mrol_map::planning::Frontier;
use mrol_service::ScanAnswer;

/// Ways that are tried before it is said that there is none.
const WAYS_TRIED: usize = 150;

/// What the robot did last.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Step {
    /// It drove to see a frontier.
    Visited {
        /// The frontier.
        frontier: Box<Frontier>,
        /// Length of the way, meters.
        way_m: f64,
        /// Frontiers that were listed and not given up.
        listed: usize,
        /// Answer to its last scan.
        scan: Box<ScanAnswer>,
        /// How far the pose that was found is from the true one, meters.
        error_m: f64,
    },
    /// No frontier is left that it can get to.
    Done {
        /// Frontiers that are left.
        left: usize,
    },
}

impl Explorer {
    /// Goes to the nearest frontier, with a scan every so often on the way and one at its end.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub(crate) async fn step(&mut self) -> Result<Step, ClientError> {
        let listed = self.frontiers().await?;
        let mut fits = self.places_that_fit().await?;
        for _ in 0..WAYS_TRIED {
            let ways = Ways::from(fits.grid, |number, _| fits.costs[number], self.place());
            let Some(Goal { frontier, cell, .. }) = self.nearest_goal(&listed, &ways).await? else {
                break;
            };
            let way: Vec<[f64; 2]> = ways.way_to(cell);
            if let Some(share) = self.first_hit(&way).await? {
                // It fits at both places and not between them: the way leads around the second.
                let after = (share * (way.len() - 1) as f64).ceil() as usize;
                fits.take_out(way[after.clamp(1, way.len() - 1)]);
                continue;
            }
            let way_m =
                way.windows(2).map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1])).sum();
            let scan = Box::new(self.drive(&way).await?);
            self.visited.push(frontier.center_m);
            let error_m = pose_difference(&self.truth, &self.believed).0;
            return Ok(Step::Visited {
                frontier: Box::new(frontier),
                way_m,
                listed: listed.len(),
                scan,
                error_m,
            });
        }
        Ok(Step::Done { left: listed.len() })
    }
}
