//! An attacker: it asks again as soon as it is answered, or soon after.

use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use tokio::time::sleep;

use super::aim::Aim;
use super::kind::Attack;
use super::loiterer::loiter;
use super::made::Made;
use crate::fleet::error::FleetError;
use crate::fleet::http::HttpConnection;
use crate::fleet::tally::Tally;
use mrol_client::Client;
use mrol_map::map::RobotName;

/// How long an attacker waits that was refused, so that the attackers' own machine has time for the answers.
const AFTER_REFUSAL: Duration = Duration::from_millis(50);
/// Names of the robots of tiny scans: as many as a map has at most, less one.
const TINY_ROBOTS: usize = 4095;

/// An attacker, and its one kind of attack.
pub(super) struct Attacker {
    pub(super) attack: Attack,
    /// Among those who attack in the same way.
    pub(super) number: usize,
    pub(super) aim: Arc<Aim>,
    pub(super) made: Arc<Made>,
    pub(super) tally: Arc<Mutex<Tally>>,
}

impl Attacker {
    /// Attacks for ever.
    pub(super) async fn work(self) {
        let mut connection = None;
        for round in 0.. {
            let begin = std::time::Instant::now();
            let failed = self.round(&mut connection, round).await.err();
            let refused = failed.is_some();
            self.tally.lock().count(begin.elapsed(), failed.map(|error| error.to_string()));
            sleep(if refused { AFTER_REFUSAL } else { self.attack.pause() }).await;
        }
    }

    async fn round(&self, connection: &mut Option<Connection>, round: usize) -> Result<(), FleetError> {
        if self.attack == Attack::Connections {
            return loiter(&self.aim, self.number).await;
        }
        let connection = match connection {
            Some(connection) => connection,
            None => connection.insert(self.connect().await?),
        };
        match connection {
            Connection::Grpc(client) => self.ask(client, round).await,
            Connection::Http(http) => http.get().await.map(drop),
        }
    }

    async fn connect(&self) -> Result<Connection, FleetError> {
        let Aim { shared, large, .. } = &*self.aim;
        let http = |path: String| self.aim.at(&path).map(|http| Connection::Http(Box::new(http)));
        match self.attack {
            Attack::Listings => http(format!("/v1/maps/{shared}/voxels")),
            Attack::Counts => http(format!(
                "/v1/maps/{large}/voxels?count_only=true&map_from_box=0,0,0,0,0,0.382683,0.923880&size=200,200,40"
            )),
            Attack::Watches => http(format!("/v1/maps/{shared}/watch")),
            Attack::Connections => Err(FleetError::failed("nothing is asked there")),
            _ => Ok(Connection::Grpc(self.aim.connect(self.attack.inserts()).await?)),
        }
    }

    async fn ask(&self, client: &Client, round: usize) -> Result<(), FleetError> {
        let (Aim { shared, large, own, .. }, made, number) = (&*self.aim, &*self.made, self.number);
        let robot = |name: String| RobotName::new(&name).map_err(FleetError::failed);
        match self.attack {
            Attack::Motions => client.check_motions(shared, made.motions.clone()).await.map(drop)?,
            Attack::Poses => client.check_poses(shared, made.poses.clone()).await.map(drop)?,
            Attack::Rays => client.cast_rays(shared, made.rays.clone()).await.map(drop)?,
            Attack::Classifications => client.classify_points(shared, made.points.clone()).await.map(drop)?,
            Attack::Alignments => {
                let scan = made.doubtful(robot(format!("doubtful-{number}"))?);
                client.align_scan(shared, scan).await.map(drop)?;
            }
            Attack::Localizations => client.localize(shared, made.lost()).await.map(drop)?,
            Attack::Scans => {
                client.insert_scan(own, made.placed(robot(format!("many-{number}"))?)).await.map(drop)?;
            }
            Attack::Grids => client.project_grid(large, made.grid).await.map(drop)?,
            Attack::TinyScans => {
                let name = format!("tiny-{}", (round * Attack::TinyScans.at_once() + number) % TINY_ROBOTS);
                client.insert_scan(own, made.tiny(robot(name)?)).await.map(drop)?;
            }
            Attack::Garbage => {
                client
                    .insert_scan(shared, made.garbage(robot(format!("garbage-{number}"))?))
                    .await
                    .map(drop)?;
            }
            Attack::LostRobots => {
                let scan = made.elsewhere(robot(format!("lost-{number}"))?);
                client.insert_scan(shared, scan).await.map(drop)?;
            }
            Attack::Listings | Attack::Counts | Attack::Watches | Attack::Connections => {}
        }
        Ok(())
    }
}

/// The way to the server.
enum Connection {
    Grpc(Client),
    Http(Box<HttpConnection>),
}
