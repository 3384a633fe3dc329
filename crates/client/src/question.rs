//! Questions of planners: a method for each, and one for a stream of each that is asked often.

use tokio_stream::{Stream, StreamExt};

use super::answers::Answers;
use super::client::Client;
use super::error::ClientError;
use crate::wire::pb;
use mrol_map::map::MapName;
use mrol_map::planning::{Frontiers, Grid, MotionAnswer, NearestVoxels, PointStates, RayHits};
use mrol_service::{
    Answered, ClassifyQuestion, Collisions, FrontierQuestion, GridQuestion, MotionCheck, NearestQuestion,
    PoseCheck, RayQuestion, SphereCheck,
};

impl Client {
    /// Returns of each configuration whether a body meets a voxel, or what it meets first, or how much room it has, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn check_poses(
        &self,
        map: &MapName,
        check: PoseCheck,
    ) -> Result<Answered<Collisions>, ClientError> {
        let request = self.request((map, check));
        self.domain(self.connection.occupancy().check_poses(request).await)
    }

    /// Checks batch after batch of configurations, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn pose_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = PoseCheck> + Send + 'static,
    ) -> Result<Answers<Answered<Collisions>>, ClientError> {
        let map = map.clone();
        let requests = batches.map(move |check| pb::CheckPosesRequest::from((&map, check)));
        let answers = self.connection.occupancy().check_poses_stream(requests).await;
        self.connection.answers(answers)
    }

    /// Returns of each group of spheres whether one meets a voxel, or which meets one first, or how much room there is, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn check_spheres(
        &self,
        map: &MapName,
        check: SphereCheck,
    ) -> Result<Answered<Collisions>, ClientError> {
        let request = self.request((map, check));
        self.domain(self.connection.occupancy().check_spheres(request).await)
    }

    /// Checks batch after batch of spheres, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn sphere_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = SphereCheck> + Send + 'static,
    ) -> Result<Answers<Answered<Collisions>>, ClientError> {
        let map = map.clone();
        let requests = batches.map(move |check| pb::CheckSpheresRequest::from((&map, check)));
        let answers = self.connection.occupancy().check_spheres_stream(requests).await;
        self.connection.answers(answers)
    }

    /// Returns of each motion whether a body can make it, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn check_motions(
        &self,
        map: &MapName,
        check: MotionCheck,
    ) -> Result<Answered<Vec<MotionAnswer>>, ClientError> {
        let request = self.request((map, check));
        self.domain(self.connection.occupancy().check_motions(request).await)
    }

    /// Checks batch after batch of motions, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn motion_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = MotionCheck> + Send + 'static,
    ) -> Result<Answers<Answered<Vec<MotionAnswer>>>, ClientError> {
        let map = map.clone();
        let requests = batches.map(move |check| pb::CheckMotionsRequest::from((&map, check)));
        let answers = self.connection.occupancy().check_motions_stream(requests).await;
        self.connection.answers(answers)
    }

    /// Returns what each ray meets first, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn cast_rays(
        &self,
        map: &MapName,
        rays: RayQuestion,
    ) -> Result<Answered<RayHits>, ClientError> {
        let request = self.request((map, rays));
        self.domain(self.connection.occupancy().cast_rays(request).await)
    }

    /// Casts batch after batch of rays, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn ray_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = RayQuestion> + Send + 'static,
    ) -> Result<Answers<Answered<RayHits>>, ClientError> {
        let map = map.clone();
        let requests = batches.map(move |rays| pb::CastRaysRequest::from((&map, rays)));
        let answers = self.connection.occupancy().cast_rays_stream(requests).await;
        self.connection.answers(answers)
    }

    /// Returns the occupied voxel that is nearest to each point, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn find_nearest(
        &self,
        map: &MapName,
        points: NearestQuestion,
    ) -> Result<Answered<NearestVoxels>, ClientError> {
        let request = self.request((map, points));
        self.domain(self.connection.occupancy().find_nearest(request).await)
    }

    /// Looks around batch after batch of points, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn nearest_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = NearestQuestion> + Send + 'static,
    ) -> Result<Answers<Answered<NearestVoxels>>, ClientError> {
        let map = map.clone();
        let requests = batches.map(move |points| pb::FindNearestRequest::from((&map, points)));
        let answers = self.connection.occupancy().find_nearest_stream(requests).await;
        self.connection.answers(answers)
    }

    /// Returns of each point whether it is occupied, free, or unknown, all at one revision.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn classify_points(
        &self,
        map: &MapName,
        points: ClassifyQuestion,
    ) -> Result<Answered<PointStates>, ClientError> {
        let request = self.request((map, points));
        self.domain(self.connection.occupancy().classify_points(request).await)
    }

    /// Classifies batch after batch of points, with one answer for each, without a round trip between two batches.
    ///
    /// # Errors
    /// When the server cannot be reached; a refused batch ends the answers.
    pub async fn classification_stream(
        &self,
        map: &MapName,
        batches: impl Stream<Item = ClassifyQuestion> + Send + 'static,
    ) -> Result<Answers<Answered<PointStates>>, ClientError> {
        let map = map.clone();
        let requests = batches.map(move |points| pb::ClassifyPointsRequest::from((&map, points)));
        let answers = self.connection.occupancy().classify_points_stream(requests).await;
        self.connection.answers(answers)
    }

    /// Returns the frontiers in a box, the largest first, each with a place from which it can be seen.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn list_frontiers(
        &self,
        map: &MapName,
        question: FrontierQuestion,
    ) -> Result<Answered<Frontiers>, ClientError> {
        let request = self.request((map, question));
        self.domain(self.connection.occupancy().list_frontiers(request).await)
    }

    /// Returns the map from above, as a 2-D grid.
    ///
    /// # Errors
    /// When the server refuses, or cannot be reached.
    pub async fn project_grid(
        &self,
        map: &MapName,
        grid: GridQuestion,
    ) -> Result<Answered<Grid>, ClientError> {
        let request = self.request((map, grid));
        self.domain(self.connection.occupancy().project_grid(request).await)
    }
}
