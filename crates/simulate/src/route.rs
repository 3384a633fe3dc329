//! Routes of the robots on the floor: closed lines of straight stretches with smoothed corners.
//!
//! They depend on the building alone; furniture is placed away from them.

/// Number of positions that are averaged for one smoothed position.
const AVERAGED: usize = 24;

/// Route of the lidar robot: from room to room through every door, twice along the corridor: 44 m.
pub(super) const LIDAR_ROUTE: Route = Route {
    corners: &[
        [4.6, 6.9],
        [11.0, 6.9],
        [11.0, 4.6],
        [2.5, 4.6],
        [2.5, 2.1],
        [11.0, 2.1],
        [11.0, 4.6],
        [2.5, 4.6],
        [2.5, 6.9],
    ],
    cornering_m: 1.4,
    turning_m: 2.3,
};

/// Route of the camera robot: the northern rooms and the corridor: 22 m, half a meter or less beside the other route.
pub(super) const CAMERA_ROUTE: Route = Route {
    corners: &[[4.0, 6.75], [10.8, 6.75], [10.8, 4.45], [2.65, 4.45], [2.65, 6.75]],
    cornering_m: 1.4,
    turning_m: 2.3,
};

/// A closed route. Positions on it are given by the distance from its start, meters, lap after lap.
pub(super) struct Route {
    /// Corners in the map frame, meters. The first is the start and lies on a straight stretch.
    corners: &'static [[f64; 2]],
    /// Length over which positions are averaged: a corner is cut from half of it before to half of it after.
    cornering_m: f64,
    /// Length over which the robot turns at a corner; the corners lie at least this far apart.
    turning_m: f64,
}

impl Route {
    /// Length of one lap along the corners, meters.
    pub(super) fn length_m(&self) -> f64 {
        self.stretches().map(distance).sum()
    }

    /// The position after `way_m`, map frame, meters.
    pub(super) fn position(&self, way_m: f64) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for i in 0..AVERAGED {
            let offset = (i as f64 + 0.5) / AVERAGED as f64 - 0.5;
            let [x, y] = self.unsmoothed(way_m + offset * self.cornering_m);
            sum = [sum[0] + x, sum[1] + y];
        }
        sum.map(|c| c / AVERAGED as f64)
    }

    /// The heading after `way_m`, radians from the map's x axis: the turn of each corner is spread evenly over
    /// `turning_m`.
    pub(super) fn yaw(&self, way_m: f64) -> f64 {
        let way_m = way_m.rem_euclid(self.length_m());
        let stretches: Vec<_> = self.stretches().collect();
        let (mut yaw, mut corner_m) = (heading(stretches[0]), 0.0);
        for pair in stretches.windows(2) {
            corner_m += distance(pair[0]);
            let turned = ((way_m - corner_m) / self.turning_m + 0.5).clamp(0.0, 1.0);
            yaw += turned * wrapped(heading(pair[1]) - heading(pair[0]));
        }
        yaw
    }

    fn stretches(&self) -> impl Iterator<Item = Stretch> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(from, to)| (*from, *to))
    }

    fn unsmoothed(&self, way_m: f64) -> [f64; 2] {
        let mut rest_m = way_m.rem_euclid(self.length_m());
        for stretch in self.stretches() {
            let (length_m, (from, to)) = (distance(stretch), stretch);
            if rest_m <= length_m {
                let share = rest_m / length_m;
                return [0, 1].map(|i| from[i] + share * (to[i] - from[i]));
            }
            rest_m -= length_m;
        }
        self.corners[0]
    }
}

/// A straight part of a route: from, to.
type Stretch = ([f64; 2], [f64; 2]);

fn distance((from, to): Stretch) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

fn heading((from, to): Stretch) -> f64 {
    (to[1] - from[1]).atan2(to[0] - from[0])
}

/// `angle` in -pi..=pi.
fn wrapped(angle: f64) -> f64 {
    angle.sin().atan2(angle.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_route_is_as_long_as_its_stretches_and_ends_where_it_starts() {
        assert!((LIDAR_ROUTE.length_m() - 43.6).abs() < 1e-9);
        for route in [LIDAR_ROUTE, CAMERA_ROUTE] {
            let (start, lap_m) = (route.position(0.0), route.length_m());
            assert!(distance((start, route.corners[0])) < 1e-9);
            assert!(distance((start, route.position(lap_m))) < 1e-9);
        }
    }

    #[test]
    fn the_heading_follows_the_way_without_a_jump() {
        for route in [LIDAR_ROUTE, CAMERA_ROUTE] {
            for i in 0..2 * (route.length_m() / 0.05) as usize {
                let (way_m, next_m) = (i as f64 * 0.05, (i + 1) as f64 * 0.05);
                let turn = wrapped(route.yaw(next_m) - route.yaw(way_m)).to_degrees();
                assert!(turn.abs() < 2.0, "{turn} degrees at {way_m} m");
                let chord = heading((route.position(way_m - 0.7), route.position(way_m + 0.7)));
                assert!(wrapped(chord - route.yaw(way_m)).to_degrees().abs() < 25.0, "at {way_m} m");
            }
        }
    }
}
