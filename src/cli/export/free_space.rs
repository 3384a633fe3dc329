//! Which cells of a map are free: asked of the map in a file, or of a server.

use mrol::console::CliError;
use mrol_client::Client;
use mrol_map::geometry::Point;
use mrol_map::map::{MapContents, MapName, MapSettings, MultiResolutionMap};
use mrol_map::planning::{PointStates, classify_points};
use mrol_map::util::StopSignal;
use mrol_service::{ClassifyQuestion, QuestionScope};

/// What knows which cells of a level are free. Keep-outs do not count: nobody measured them.
pub(super) enum FreeSpace<'a> {
    /// A map at hand.
    Map { map: Box<MultiResolutionMap>, level: u32 },
    /// A map of a server.
    Server { client: &'a Client, name: &'a MapName, scope: QuestionScope },
}

impl<'a> FreeSpace<'a> {
    /// That of a map with these contents.
    ///
    /// # Errors
    /// When the settings are out of range.
    pub(super) fn of_contents(
        settings: MapSettings,
        contents: MapContents,
        level: u32,
    ) -> Result<Self, CliError> {
        // Its filters and moments are asked for nothing.
        let settings = MapSettings { filter: None, moments: false, ..settings };
        let map = MultiResolutionMap::restore(settings, contents).map_err(CliError::failed)?;
        Ok(Self::Map { map: Box::new(map), level })
    }

    /// That of a server's map, at a revision or a later one.
    pub(super) fn of_server(client: &'a Client, name: &'a MapName, level: u32, revision: u64) -> Self {
        let scope = QuestionScope {
            level,
            min_revision: Some(revision),
            ignore_keep_outs: true,
            ..QuestionScope::default()
        };
        Self::Server { client, name, scope }
    }

    /// True where a cell between two corners (map frame, meters) may be free.
    pub(super) fn may_be_in(&self, low_m: [f64; 3], high_m: [f64; 3]) -> bool {
        match self {
            Self::Map { map, .. } => map.viewpoints().may_cover(low_m, high_m),
            Self::Server { .. } => true,
        }
    }

    /// What is known of cells, each by its center.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub(super) async fn states(&self, centers: &[Point]) -> Result<PointStates, CliError> {
        match self {
            Self::Map { map, level } => {
                let view = map.view().with_viewpoints();
                classify_points(&view, centers, *level, StopSignal::NEVER).map_err(CliError::failed)
            }
            Self::Server { client, name, scope } => {
                let question = ClassifyQuestion { asked: *scope, points: centers.to_vec().into() };
                let states = client.classify_points(name, question).await?.answer;
                match states.points == centers.len() {
                    true => Ok(states),
                    false => {
                        let (got, asked) = (states.points, centers.len());
                        Err(CliError::failed(format!("the server answered {got} of {asked} points")))
                    }
                }
            }
        }
    }
}
