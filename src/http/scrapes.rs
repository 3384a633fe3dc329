//! The answer to scrapes of the metrics: made by one of them at a time, kept for a while, and shared.

use std::sync::{Arc, Weak};
use std::time::Duration;

use axum::body::Bytes;
use tokio::sync::Mutex;
use tokio::time::Instant;

use mrol_service::{AllowedMaps, ServiceError};

/// Texts that are in memory at once, those among them that somebody still reads. Where there are as many, the newest
/// answers however old it is.
const TEXTS_MAX: usize = 4;

/// Texts of metrics, by the maps that they tell of. A clone has the same ones.
#[derive(Debug, Clone)]
pub(super) struct Scrapes {
    kept_for: Duration,
    texts: Arc<Mutex<Texts>>,
}

#[derive(Debug, Default)]
struct Texts {
    newest: Vec<Newest>,
    /// All that somebody may hold.
    alive: Vec<Weak<String>>,
}

#[derive(Debug)]
struct Newest {
    allowed_maps: AllowedMaps,
    made: Instant,
    text: Arc<String>,
}

impl Scrapes {
    pub(super) fn new(kept_for: Duration) -> Self {
        Self { kept_for, texts: Arc::default() }
    }

    /// The text for a caller who may name the allowed maps, made by `make` where the last one is too old.
    ///
    /// # Errors
    /// `ResourceExhausted` where as many texts are being read as may be, and none of them is for the caller.
    pub(super) async fn text(
        &self,
        allowed_maps: &AllowedMaps,
        make: impl AsyncFnOnce() -> String,
    ) -> Result<Bytes, ServiceError> {
        // Whoever comes meanwhile waits for the same text.
        let mut texts = self.texts.lock().await;
        if let Some(newest) = texts.newest.iter().find(|newest| newest.allowed_maps == *allowed_maps)
            && (newest.made.elapsed() < self.kept_for || texts.is_full())
        {
            return Ok(shared(&newest.text));
        }
        texts.forget(allowed_maps, self.kept_for);
        if texts.is_full() {
            return Err(ServiceError::overloaded(format!(
                "{TEXTS_MAX} scrapes are still being read: try again"
            )));
        }
        let (text, made) = (Arc::new(make().await), Instant::now());
        texts.alive.push(Arc::downgrade(&text));
        let answer = shared(&text);
        texts.newest.push(Newest { allowed_maps: allowed_maps.clone(), made, text });
        Ok(answer)
    }
}

impl Texts {
    /// True where as many are held as may be, but for the newest ones that nobody reads.
    fn is_full(&self) -> bool {
        let alive = self.alive.iter().filter(|text| text.strong_count() > 0).count();
        let idle = self.newest.iter().filter(|newest| Arc::strong_count(&newest.text) == 1).count();
        alive - idle.min(alive) >= TEXTS_MAX
    }

    /// Drops the caller's last text, and those that are too old for others.
    fn forget(&mut self, allowed_maps: &AllowedMaps, kept_for: Duration) {
        self.newest.retain(|newest| newest.allowed_maps != *allowed_maps && newest.made.elapsed() < kept_for);
        // As many as there may be of callers who ask at once.
        let many = self.newest.len().saturating_sub(TEXTS_MAX - 1);
        self.newest.drain(..many);
        self.alive.retain(|text| text.strong_count() > 0);
    }
}

fn shared(text: &Arc<String>) -> Bytes {
    struct Owner(Arc<String>);
    impl AsRef<[u8]> for Owner {
        fn as_ref(&self) -> &[u8] {
            self.0.as_bytes()
        }
    }
    Bytes::from_owner(Owner(Arc::clone(text)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mrol_map::map::MapName;
    use mrol_service::Reason;

    const KEPT: Duration = Duration::from_secs(1);

    async fn scrape(scrapes: &Scrapes, number: u32) -> Bytes {
        scrapes.text(&AllowedMaps::Every, async || number.to_string()).await.unwrap()
    }

    #[tokio::test(start_paused = true)]
    async fn a_text_answers_for_a_while() {
        let scrapes = Scrapes::new(KEPT);
        assert_eq!(scrape(&scrapes, 1).await, "1");
        assert_eq!(scrape(&scrapes, 2).await, "1");
        tokio::time::sleep(KEPT).await;
        assert_eq!(scrape(&scrapes, 3).await, "3");
    }

    #[tokio::test(start_paused = true)]
    async fn who_may_name_other_maps_gets_another_text() {
        let scrapes = Scrapes::new(KEPT);
        let only = AllowedMaps::Only(Arc::new([MapName::new("a").unwrap()].into()));
        assert_eq!(scrape(&scrapes, 1).await, "1");
        assert_eq!(scrapes.text(&only, async || "a".into()).await.unwrap(), "a");
        assert_eq!(scrape(&scrapes, 2).await, "1");
    }

    #[tokio::test(start_paused = true)]
    async fn no_more_texts_are_held_than_may_be() {
        let scrapes = Scrapes::new(KEPT);
        let mut held = Vec::new();
        for number in 1..10 {
            held.push(scrape(&scrapes, number).await);
            tokio::time::sleep(KEPT).await;
        }
        assert_eq!(held[3], "4");
        assert!(held[4..].iter().all(|text| text == "4"));
        let none = scrapes.text(&AllowedMaps::none(), async || "none".into()).await;
        assert_eq!(none.unwrap_err().reason, Reason::Overloaded);
        held.clear();
        assert_eq!(scrape(&scrapes, 10).await, "10");
    }
}
