//! Where bodies are: for a copy of a part of a map, to know whether that part is enough.

use super::body_of_links::Body;
use super::configurations::Configurations;
use super::path::LinkMotion;
use super::placement::{CellsFromLink, LinkPose};

/// A sphere or point of a body, in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlacedPart {
    /// The link that it belongs to.
    pub link: usize,
    /// Its center, meters.
    pub center_m: [f64; 3],
    /// Its radius with the link's padding, meters.
    pub radius_m: f64,
}

impl Body {
    /// The spheres and points of the body in one of its configurations.
    ///
    /// # Panics
    /// When there is no such configuration.
    pub fn placed(
        &self,
        configurations: Configurations<'_>,
        configuration: usize,
    ) -> impl Iterator<Item = PlacedPart> {
        let poses = configurations.poses_of(configuration);
        self.links().iter().zip(poses).enumerate().flat_map(|(link, (of, pose))| {
            let map_from_link = CellsFromLink::of(&LinkPose::of(pose), 1.0);
            of.padded().map(move |(center_m, radius_m)| PlacedPart {
                link,
                center_m: map_from_link.cells(center_m),
                radius_m,
            })
        })
    }

    /// How far a center of `link` strays at most from the line between its places in a configuration and the next,
    /// meters.
    ///
    /// # Panics
    /// When there are no such configurations.
    pub fn strays_m(&self, configurations: Configurations<'_>, from: usize, link: usize) -> f64 {
        let pose = |configuration: usize| LinkPose::of(&configurations.poses_of(configuration)[link]);
        let motion = LinkMotion::new(&pose(from), &pose(from + 1));
        let extent_m = |center: [f64; 3]| center.iter().map(|c| c * c).sum::<f64>().sqrt();
        let far_m = self.links()[link].padded().map(|(center, _)| extent_m(center)).fold(0.0, f64::max);
        // After a share s of the turn by a, a center is s a r from where it would be without, and (1 - s) a r from
        // where it would be at the end: 2 s (1 - s) a r from the line at most.
        (motion.length_m(far_m) - motion.length_m(0.0)) / 2.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::{Link, Sphere};
    use proptest::prelude::*;

    fn pose() -> impl Strategy<Value = [f32; 7]> {
        let turned = prop::array::uniform4(-1.0f32..1.0)
            .prop_filter("a rotation", |q| q.iter().map(|c| c * c).sum::<f32>() > 0.1);
        (prop::array::uniform3(-5.0f32..5.0), turned).prop_map(|([x, y, z], q)| {
            let norm = q.iter().map(|c| c * c).sum::<f32>().sqrt();
            let [a, b, c, d] = q.map(|c| c / norm);
            [x, y, z, a, b, c, d]
        })
    }

    proptest! {
        #[test]
        fn no_center_strays_further_than_told(from in pose(), to in pose(), center_m in prop::array::uniform3(-2.0f32..2.0)) {
            let spheres = vec![Sphere { center_m, radius_m: 0.1 }];
            let body = Body::new(vec![Link { spheres, ..Link::default() }]).unwrap();
            let numbers = [from, to].concat();
            let configurations = Configurations::new(&numbers, 1).unwrap();
            let [a, b] = [0, 1].map(|i| body.placed(configurations, i).next().unwrap().center_m);
            let motion = LinkMotion::new(&LinkPose::of(&from), &LinkPose::of(&to));
            for step in 0..=20 {
                let share = f64::from(step) / 20.0;
                let at = CellsFromLink::of(&motion.at(share), 1.0).cells(center_m.map(f64::from));
                let line: [f64; 3] = std::array::from_fn(|axis| a[axis] + share * (b[axis] - a[axis]));
                let away = (0..3).map(|axis| (at[axis] - line[axis]).powi(2)).sum::<f64>().sqrt();
                prop_assert!(away <= body.strays_m(configurations, 0, 0) + 1e-6);
            }
        }
    }
}
