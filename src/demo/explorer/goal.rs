//! Where the robot goes: the nearest place from which a frontier can be seen.

use super::frontier_explorer::Explorer;
use super::standing::SENSOR_HEIGHT_M;
use super::ways::{Cell, Ways};
use mrol_client::ClientError;
use mrol_map::geometry::Point;
use mrol_map::planning::{Frontier, Unknown};
use mrol_service::{QuestionScope, RayQuestion, RaysToward};

/// How far from the place from which a frontier can be seen the robot may stop, meters.
const NEAR_VIEW_M: f64 = 0.4;
/// A place is new that is so far from all where it looked around, meters.
const NEW_PLACE_M: f64 = 0.45;
/// From how far away a frontier is looked at where the robot cannot get to the place that the server names, meters.
const LOOK_M: [f64; 2] = [0.7, 3.0];
/// One of so many places along each axis is tried for that.
const LOOK_EVERY: usize = 3;

/// Where the robot could go.
pub(super) struct Goal {
    pub(super) frontier: Frontier,
    pub(super) cell: Cell,
    cost: f64,
}

/// A place from which something could be seen.
struct Look {
    cell: Cell,
    cost: f64,
    /// Where the sensor would be.
    origin_m: [f64; 3],
}

/// The places that can be reached from which the sensor looks at a target neither from too near nor too steeply.
fn looks_at([x, y, z]: [f64; 3], ways: &Ways) -> impl Iterator<Item = Look> + '_ {
    const STEEPEST: f64 = 1.1;
    ways.reached(LOOK_EVERY).filter_map(move |(cell, cost, place)| {
        let distance_m = (place[0] - x).hypot(place[1] - y);
        let is_seen = (LOOK_M[0]..LOOK_M[1]).contains(&distance_m)
            && (z - SENSOR_HEIGHT_M).abs() <= STEEPEST * distance_m;
        is_seen.then_some(Look { cell, cost, origin_m: [place[0], place[1], SENSOR_HEIGHT_M] })
    })
}

fn point(place_m: [f64; 3]) -> Point {
    Point::from(place_m.map(|c| c as f32))
}

impl Explorer {
    /// The nearest place from which a frontier can be seen: where the server says, or else from where a ray to it meets
    /// nothing.
    pub(super) async fn nearest_goal(
        &self,
        frontiers: &[Frontier],
        ways: &Ways,
    ) -> Result<Option<Goal>, ClientError> {
        let (mut goals, mut looks) = (Vec::new(), Vec::new());
        for &frontier in frontiers {
            let target_m = frontier.view.map_or(frontier.center_m, |view| view.target_m);
            let view = frontier.view.map(|view| view.map_from_view.translation.vector);
            let view = view.filter(|view| self.is_new_place([view.x, view.y]));
            match view.and_then(|view| ways.nearest_to([view.x, view.y], NEAR_VIEW_M)) {
                Some((cell, cost)) => goals.push(Goal { frontier, cell, cost }),
                None => looks.extend(
                    looks_at(target_m, ways)
                        .filter(|look| self.is_new_place([look.origin_m[0], look.origin_m[1]]))
                        .map(|look| (frontier, target_m, look)),
                ),
            }
        }
        let toward = looks.iter().map(|(_, target_m, _)| point(*target_m)).collect::<Vec<_>>();
        let origins = looks.iter().map(|(_, _, look)| point(look.origin_m)).collect::<Vec<_>>();
        if !looks.is_empty() {
            let question = RayQuestion {
                asked: QuestionScope::default(),
                origins: origins.into(),
                toward: RaysToward::Ends(toward.into()),
                unknown: Unknown::Free,
            };
            let hits = self.client.cast_rays(&self.map, question).await?.answer;
            let clear =
                looks.iter().zip(&hits.distances_m).filter(|(_, distance_m)| distance_m.is_infinite());
            goals.extend(clear.map(|((frontier, _, look), _)| Goal {
                frontier: *frontier,
                cell: look.cell,
                cost: look.cost,
            }));
        }
        Ok(goals.into_iter().min_by(|one, other| one.cost.total_cmp(&other.cost)))
    }

    /// True where it has not looked around yet: it would see the same again.
    fn is_new_place(&self, [x, y]: [f64; 2]) -> bool {
        self.looked.iter().all(|[looked_x, looked_y]| (x - looked_x).hypot(y - looked_y) >= NEW_PLACE_M)
    }
}
