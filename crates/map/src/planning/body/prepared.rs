//! Bodies in cells that are kept: a planner asks about the same body again and again.

use std::borrow::Cow;
use std::sync::OnceLock;

use super::in_cells::BodyInCells;
use super::parts::Link;
use crate::planning::error::PlanningError;

/// Sizes of cells for which a body is kept: those of as many levels, of maps of the same resolution. It is made anew
/// for others.
const KEPT: usize = 4;

/// One body, for each size of cells that it was asked about with.
#[derive(Debug, Default)]
pub(super) struct Prepared([OnceLock<InCells>; KEPT]);

#[derive(Debug)]
struct InCells {
    cells_per_m: f64,
    body: BodyInCells,
}

impl Prepared {
    /// The body of `links` in cells, so many a meter. It is always asked about the same links.
    ///
    /// # Errors
    /// For spheres that are too large for such cells.
    pub(super) fn of(&self, links: &[Link], cells_per_m: f64) -> Result<Cow<'_, BodyInCells>, PlanningError> {
        if let Some(kept) = self.kept(cells_per_m) {
            return Ok(Cow::Borrowed(kept));
        }
        let mut made = InCells { cells_per_m, body: BodyInCells::of(links, cells_per_m)? };
        for place in &self.0 {
            made = match place.set(made) {
                Ok(()) => return self.of(links, cells_per_m),
                Err(refused) => refused,
            };
        }
        Ok(Cow::Owned(made.body))
    }

    fn kept(&self, cells_per_m: f64) -> Option<&BodyInCells> {
        let mut made = self.0.iter().map_while(OnceLock::get);
        made.find(|kept| kept.cells_per_m == cells_per_m).map(|kept| &kept.body)
    }
}

impl Clone for Prepared {
    /// Nothing is kept of a body that was just made.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Prepared {
    /// Bodies of the same links are the same, whatever is kept.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::Sphere;

    #[test]
    fn a_body_is_made_once_for_a_size_of_cells_and_anew_for_those_beyond_what_is_kept() {
        let spheres = vec![Sphere { center_m: [0.0; 3], radius_m: 1.0 }];
        let links = [Link { spheres, ..Link::default() }];
        let prepared = Prepared::default();
        let is_kept = |cells_per_m: f64| {
            let body = prepared.of(&links, cells_per_m).unwrap();
            assert_eq!(body.links[0].groups[0].radius[0], cells_per_m);
            matches!(body, Cow::Borrowed(_))
        };
        assert_eq!([1.0, 2.0, 4.0, 8.0, 16.0, 2.0].map(is_kept), [true, true, true, true, false, true]);
        assert!(prepared.of(&links, 1000.0).is_err());
    }
}
