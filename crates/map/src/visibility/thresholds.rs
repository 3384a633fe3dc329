//! Every threshold of free space and carving that was found by trial, with its unit.
//!
//! What bounds memory or work, follows from the format of images, or is a setting of a robot is not here.

/// Makes [`Thresholds`] and its rows from one table.
macro_rules! thresholds {
    ($($(#[doc = $doc:literal])+ $name:ident: $unit:literal = $value:literal;)+) => {
        /// The thresholds of free space and carving that were found by trial.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Thresholds {
            $($(#[doc = $doc])+ #[doc = concat!("Unit: ", $unit, ".")] pub $name: f32,)+
        }

        impl Thresholds {
            /// Those that the server uses.
            pub const DEFAULT: Self = Self { $($name: $value,)+ };

            /// The name, the unit and the value of each.
            pub fn rows(&self) -> Vec<(&'static str, &'static str, f32)> {
                vec![$((stringify!($name), $unit, self.$name),)+]
            }

            /// These, with the one of that name `factor` times as large; none where none has it.
            pub fn scaled(&self, name: &str, factor: f32) -> Option<Self> {
                let mut scaled = *self;
                match name {
                    $(stringify!($name) => scaled.$name *= factor,)+
                    _ => return None,
                }
                Some(scaled)
            }
        }
    };
}

thresholds! {
    /// Widest part of a pixel of which a point tells: what lies between points is not looked at.
    spacing_max: "side of a square at depth 1" = 0.025;
    /// Scans whose points lie farther from each other as a rule tell less: all parts of a pixel have to be seen.
    sparse: "side of a square at depth 1" = 0.09;
    /// Pixels are a sieve that leave wider gaps beside more of those with points.
    sieve_share_max: "share of the pixels with points" = 0.05;
    /// What is farther apart is no gap between points of one surface.
    one_surface_max: "side of a square at depth 1" = 0.14;
    /// Width up to which a hole between rays is one of a few lost rays.
    lost_width_max: "spacings of the rays" = 2.2;
    /// Length up to which it is.
    lost_length_max: "spacings of the rays" = 5.0;
    /// Weight of such holes. On a square grid one lost ray leaves a hole two spacings wide, and sensors lose about 1 %
    /// of their rays; counting holes fully would rule out most tiles.
    lost_weight: "share of the width" = 0.6;
    /// An image of coarser pixels is taken where it sees so much more.
    coarser_gain_min: "times the area seen" = 1.03;
    /// Points that are farther apart say nothing of what is between them.
    patch_max: "samples of the surface" = 32.0;
    /// Balls nearer than that are not seen through: they would be looked at in too many directions.
    ball_distance_min: "radii of the ball" = 4.0;
    /// Distance of the places of a ball's disc at which a near ray is looked for.
    ray_place_step: "distances of a near ray" = 0.3;
    /// Places of a disc that may lie far from all rays: a tenth of a disc a little wider than what is near.
    ray_places_missed_max: "places" = 4.0;
    /// Distance of samples of the scan's surface.
    sample_step: "voxels within the margin" = 0.7;
    /// How far apart rays may have passed a voxel that is carved: what is larger was met by one.
    carved_gap_max: "voxels" = 1.5;
    /// The same of things one voxel wide as the map has them.
    thin_gap_max_1: "voxels" = 0.2;
    /// Of things two voxels wide.
    thin_gap_max_2: "voxels" = 0.2;
    /// Of things three voxels wide.
    thin_gap_max_3: "voxels" = 0.6;
    /// Length of a thin thing over which gaps between rays are looked for.
    thin_length: "voxels" = 3.0;
}

impl Default for Thresholds {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_scaled_by_its_name_and_the_others_stay() {
        let scaled = Thresholds::DEFAULT.scaled("carved_gap_max", 1.4).unwrap();
        assert_eq!(scaled, Thresholds { carved_gap_max: 1.4 * 1.5, ..Thresholds::DEFAULT });
        assert_eq!(Thresholds::DEFAULT.scaled("no_threshold", 2.0), None);
        assert!(Thresholds::DEFAULT.rows().len() <= 20, "a table that can be read");
    }
}
