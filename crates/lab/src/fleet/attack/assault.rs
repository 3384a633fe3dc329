//! All attacks at once, for some time.

use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use serde::{Deserialize, Serialize};
use tokio::task::JoinSet;
use tokio::time::sleep;

use super::aim::Aim;
use super::attacker::Attacker;
use super::kind::Attack;
use super::made::Made;
use crate::fleet::error::FleetError;
use crate::fleet::tally::Tally;

/// Attackers with what they ask.
pub(crate) struct Assault {
    aim: Arc<Aim>,
    made: Arc<Made>,
    attacks: Vec<Attack>,
}

/// What became of one attack.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Damage {
    /// Which.
    pub(crate) attack: Attack,
    /// Requests that were answered.
    pub(crate) answered: u64,
    /// Requests that were refused or failed.
    pub(crate) refused: u64,
    /// How long requests took, milliseconds.
    pub(crate) p50_ms: f64,
    /// The most frequent error.
    pub(crate) error: Option<String>,
}

impl Assault {
    /// Prepares `attacks`.
    pub(crate) fn new(aim: Aim, attacks: Vec<Attack>, seed: u64) -> Result<Self, FleetError> {
        Ok(Self { aim: Arc::new(aim), made: Arc::new(Made::new(seed)?), attacks })
    }

    /// Attacks for `time`.
    pub(crate) async fn work(&self, time: Duration) -> Result<Vec<Damage>, FleetError> {
        let (mut attackers, mut tallies) = (JoinSet::new(), Vec::new());
        for &attack in &self.attacks {
            let tally = Arc::new(Mutex::new(Tally::new()?));
            tallies.push((attack, Arc::clone(&tally)));
            for number in 0..attack.at_once() {
                let (aim, made, tally) = (Arc::clone(&self.aim), Arc::clone(&self.made), Arc::clone(&tally));
                attackers.spawn(Attacker { attack, number, aim, made, tally }.work());
            }
        }
        sleep(time).await;
        attackers.shutdown().await;
        Ok(tallies.into_iter().map(|(attack, tally)| Damage::of(attack, &tally.lock())).collect())
    }
}

impl Damage {
    fn of(attack: Attack, tally: &Tally) -> Self {
        let refused = tally.error_count();
        let error = tally.errors.iter().max_by_key(|(_, times)| **times).map(|(error, _)| error.clone());
        Self {
            attack,
            answered: tally.operations() - refused,
            refused,
            p50_ms: tally.quantile_ms(0.5),
            error,
        }
    }
}
