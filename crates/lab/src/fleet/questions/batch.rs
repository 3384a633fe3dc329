//! Questions that go to a server one by one, or on a stream.

use tokio_stream::wrappers::ReceiverStream;

use mrol_client::{Answers, Client, ClientError};
use mrol_map::map::MapName;
use mrol_map::planning::NUMBERS_PER_POSE;
use mrol_service::{AtVersion, MotionCheck, PoseCheck, Question, RayQuestion, RaysToward};

/// A question about many things.
pub(crate) trait Batch: Question + Clone {
    /// How many things it asks about.
    fn items(&self) -> usize;

    /// Asks it by itself.
    async fn ask(self, client: &Client, map: &MapName) -> Result<AtVersion<Self::Answer>, ClientError>;

    /// Asks one after the other on a stream.
    async fn stream(
        client: &Client,
        map: &MapName,
        batches: ReceiverStream<Self>,
    ) -> Result<Answers<AtVersion<Self::Answer>>, ClientError>;
}

impl Batch for PoseCheck {
    fn items(&self) -> usize {
        self.configurations.len() / (NUMBERS_PER_POSE * self.body.links().len())
    }

    async fn ask(self, client: &Client, map: &MapName) -> Result<AtVersion<Self::Answer>, ClientError> {
        client.check_poses(map, self).await
    }

    async fn stream(
        client: &Client,
        map: &MapName,
        batches: ReceiverStream<Self>,
    ) -> Result<Answers<AtVersion<Self::Answer>>, ClientError> {
        client.pose_stream(map, batches).await
    }
}

impl Batch for MotionCheck {
    fn items(&self) -> usize {
        self.lengths.len()
    }

    async fn ask(self, client: &Client, map: &MapName) -> Result<AtVersion<Self::Answer>, ClientError> {
        client.check_motions(map, self).await
    }

    async fn stream(
        client: &Client,
        map: &MapName,
        batches: ReceiverStream<Self>,
    ) -> Result<Answers<AtVersion<Self::Answer>>, ClientError> {
        client.motion_stream(map, batches).await
    }
}

impl Batch for RayQuestion {
    fn items(&self) -> usize {
        match &self.toward {
            RaysToward::Directions { directions, .. } => directions.len(),
            RaysToward::Ends(ends) => ends.len(),
        }
    }

    async fn ask(self, client: &Client, map: &MapName) -> Result<AtVersion<Self::Answer>, ClientError> {
        client.cast_rays(map, self).await
    }

    async fn stream(
        client: &Client,
        map: &MapName,
        batches: ReceiverStream<Self>,
    ) -> Result<Answers<AtVersion<Self::Answer>>, ClientError> {
        client.ray_stream(map, batches).await
    }
}
