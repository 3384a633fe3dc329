//! Questions of planners: a method for each, and one for a stream of each that is asked often.

use tokio_stream::{Stream, StreamExt};

use super::answers::Answers;
use super::client::Client;
use super::connection::Connection;
use super::error::ClientError;
use crate::wire::pb;
use mrol_map::map::MapName;
use mrol_map::planning::{Frontiers, Grid, MotionAnswer, NearestVoxels, PointStates, RayHits};
use mrol_service::{
    AtVersion, ClassifyQuestion, Collisions, FrontierQuestion, GridQuestion, GridTile, MapVersion,
    MotionCheck, NearestQuestion, PoseCheck, RayQuestion, Reason, ServiceError, SphereCheck, TILED_CELLS_MAX,
};

impl Client {
    /// Returns of each configuration whether a body meets a voxel, or what it meets first, or how much room it has, at
    /// the state that [`AtVersion::version`] names.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn check_poses(
        &self,
        map: &MapName,
        check: PoseCheck,
    ) -> Result<AtVersion<Collisions>, ClientError> {
        let message = pb::CheckPosesRequest::from((map, check));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().check_poses(request).await) };
        self.calls.question(map, message, send).await
    }

    /// Checks batch after batch of configurations, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn pose_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = PoseCheck> + Send + 'static,
    ) -> Result<Answers<AtVersion<Collisions>>, ClientError> {
        let name = map.clone();
        let requests = batches.map(move |check| pb::CheckPosesRequest::from((&name, check)));
        let (on, requests) =
            (self.calls.connection_of_stream(map).await?, self.calls.requests(map, requests));
        let answers = on.answers(on.occupancy().check_poses_stream(requests).await);
        self.calls.answers(map, answers)
    }

    /// Returns of each group of spheres whether one meets a voxel, or which meets one first, or how much room there is,
    /// at the state that [`AtVersion::version`] names.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn check_spheres(
        &self,
        map: &MapName,
        check: SphereCheck,
    ) -> Result<AtVersion<Collisions>, ClientError> {
        let message = pb::CheckSpheresRequest::from((map, check));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().check_spheres(request).await) };
        self.calls.question(map, message, send).await
    }

    /// Checks batch after batch of spheres, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn sphere_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = SphereCheck> + Send + 'static,
    ) -> Result<Answers<AtVersion<Collisions>>, ClientError> {
        let name = map.clone();
        let requests = batches.map(move |check| pb::CheckSpheresRequest::from((&name, check)));
        let (on, requests) =
            (self.calls.connection_of_stream(map).await?, self.calls.requests(map, requests));
        let answers = on.answers(on.occupancy().check_spheres_stream(requests).await);
        self.calls.answers(map, answers)
    }

    /// Returns of each motion whether a body can make it, at the state that [`AtVersion::version`] names.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn check_motions(
        &self,
        map: &MapName,
        check: MotionCheck,
    ) -> Result<AtVersion<Vec<MotionAnswer>>, ClientError> {
        let message = pb::CheckMotionsRequest::from((map, check));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().check_motions(request).await) };
        self.calls.question(map, message, send).await
    }

    /// Checks batch after batch of motions, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn motion_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = MotionCheck> + Send + 'static,
    ) -> Result<Answers<AtVersion<Vec<MotionAnswer>>>, ClientError> {
        let name = map.clone();
        let requests = batches.map(move |check| pb::CheckMotionsRequest::from((&name, check)));
        let (on, requests) =
            (self.calls.connection_of_stream(map).await?, self.calls.requests(map, requests));
        let answers = on.answers(on.occupancy().check_motions_stream(requests).await);
        self.calls.answers(map, answers)
    }

    /// Returns what each ray meets first, at the state that [`AtVersion::version`] names.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn cast_rays(
        &self,
        map: &MapName,
        rays: RayQuestion,
    ) -> Result<AtVersion<RayHits>, ClientError> {
        let message = pb::CastRaysRequest::from((map, rays));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().cast_rays(request).await) };
        self.calls.question(map, message, send).await
    }

    /// Casts batch after batch of rays, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn ray_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = RayQuestion> + Send + 'static,
    ) -> Result<Answers<AtVersion<RayHits>>, ClientError> {
        let name = map.clone();
        let requests = batches.map(move |rays| pb::CastRaysRequest::from((&name, rays)));
        let (on, requests) =
            (self.calls.connection_of_stream(map).await?, self.calls.requests(map, requests));
        let answers = on.answers(on.occupancy().cast_rays_stream(requests).await);
        self.calls.answers(map, answers)
    }

    /// Returns the occupied voxel that is nearest to each point, at the state that [`AtVersion::version`] names.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn find_nearest(
        &self,
        map: &MapName,
        points: NearestQuestion,
    ) -> Result<AtVersion<NearestVoxels>, ClientError> {
        let message = pb::FindNearestRequest::from((map, points));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().find_nearest(request).await) };
        self.calls.question(map, message, send).await
    }

    /// Looks around batch after batch of points, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn nearest_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = NearestQuestion> + Send + 'static,
    ) -> Result<Answers<AtVersion<NearestVoxels>>, ClientError> {
        let name = map.clone();
        let requests = batches.map(move |points| pb::FindNearestRequest::from((&name, points)));
        let (on, requests) =
            (self.calls.connection_of_stream(map).await?, self.calls.requests(map, requests));
        let answers = on.answers(on.occupancy().find_nearest_stream(requests).await);
        self.calls.answers(map, answers)
    }

    /// Returns of each point whether it is occupied, free, or unknown, at the state that [`AtVersion::version`] names.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn classify_points(
        &self,
        map: &MapName,
        points: ClassifyQuestion,
    ) -> Result<AtVersion<PointStates>, ClientError> {
        let message = pb::ClassifyPointsRequest::from((map, points));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().classify_points(request).await) };
        self.calls.question(map, message, send).await
    }

    /// Classifies batch after batch of points, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn classification_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = ClassifyQuestion> + Send + 'static,
    ) -> Result<Answers<AtVersion<PointStates>>, ClientError> {
        let name = map.clone();
        let requests = batches.map(move |points| pb::ClassifyPointsRequest::from((&name, points)));
        let (on, requests) =
            (self.calls.connection_of_stream(map).await?, self.calls.requests(map, requests));
        let answers = on.answers(on.occupancy().classify_points_stream(requests).await);
        self.calls.answers(map, answers)
    }

    /// Returns the frontiers in a box, the largest first, each with a place from which it can be seen.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_frontiers(
        &self,
        map: &MapName,
        question: FrontierQuestion,
    ) -> Result<AtVersion<Frontiers>, ClientError> {
        let message = pb::ListFrontiersRequest::from((map, question));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().list_frontiers(request).await) };
        self.calls.question(map, message, send).await
    }

    /// Returns the map from above, as a 2-D grid.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn project_grid(
        &self,
        map: &MapName,
        grid: GridQuestion,
    ) -> Result<AtVersion<Grid>, ClientError> {
        let message = pb::ProjectGridRequest::from((map, grid));
        let send =
            |on: Connection, request| async move { on.domain(on.occupancy().project_grid(request).await) };
        self.calls.question(map, message, send).await
    }

    /// The map from above in tiles, each at a revision of its own: of a grid that is too large for one answer, or takes
    /// longer than one may. [`Client::whole_grid`] joins them.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached; an error among the tiles is the last one.
    pub async fn grid_tiles(
        &self,
        map: &MapName,
        grid: GridQuestion,
    ) -> Result<Answers<GridTile>, ClientError> {
        let message = pb::ProjectGridRequest::from((map, grid));
        let open =
            |on: Connection, request| async move { on.answers(on.occupancy().stream_grid(request).await) };
        self.calls.with_timeout(None).question(map, message, open).await
    }

    /// The map from above, joined of tiles, with the versions of the first tile and of the last: equal where the map
    /// did not change meanwhile.
    ///
    /// # Errors
    /// When the server refuses, cannot be reached, or sends tiles that make no grid.
    pub async fn whole_grid(
        &self,
        map: &MapName,
        grid: GridQuestion,
    ) -> Result<(Grid, [MapVersion; 2]), ClientError> {
        let message = pb::ProjectGridRequest::from((map, grid));
        let read = |on: Connection, request| async move {
            joined(on.answers(on.occupancy().stream_grid(request).await)?).await
        };
        self.calls.with_timeout(None).question(map, message, read).await
    }
}

/// The grid that tiles make, with the versions of the first and of the last.
async fn joined(mut tiles: Answers<GridTile>) -> Result<(Grid, [MapVersion; 2]), ClientError> {
    let mut joined: Option<(Grid, [MapVersion; 2])> = None;
    let (mut put, mut expected) = (0, 1);
    while put < expected {
        let tile = tiles.next().await.unwrap_or_else(|| Err(no_grid("the tiles end before the last one")))?;
        let GridTile {
            origin_m, size, tiles: of_all, first, grid: AtVersion { answer: part, version }, ..
        } = tile;
        expected = of_all;
        if size[0].saturating_mul(size[1]) > TILED_CELLS_MAX {
            return Err(no_grid("there are more cells than a grid may have"));
        }
        let empty = || (Grid::empty(part.cell_m, origin_m, size, part.free.is_some()), [version; 2]);
        let (whole, versions) = joined.get_or_insert_with(empty);
        if whole.size != size || !whole.put(first, &part) {
            return Err(no_grid("a tile does not lie in the grid"));
        }
        (versions[1], put) = (version, put + 1);
    }
    joined.ok_or_else(|| no_grid("there are no tiles"))
}

/// Tiles that make no grid.
fn no_grid(why: &str) -> ClientError {
    ClientError::Answer(ServiceError::new(Reason::UnexpectedField, why))
}
