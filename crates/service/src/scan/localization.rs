//! Where a robot with no guess is in a map.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::error::{Reason, ServiceError};
use crate::limits::Limits;
use crate::map_service::MapService;
use crate::maps::HostedMap;
use crate::observer::Outcome;
use crate::request::{MapVersion, PointCloud};
use crate::resources::{Reservation, ResourceBudget};
use crate::settings::ServiceSettings;
use crate::work::check_not_stopped;
use mrol_map::align::localize::{
    Candidate, GravityError, Localization, LocalizationError, LocalizationQuery, LocalizationQueryError,
    LocalizationSettings, Supervision, localize_supervised,
};
use mrol_map::align::{RayAgreement, Rival, Verdict};
use mrol_map::geometry::{Point, Pose};
use mrol_map::map::MapName;
use mrol_map::scan::{PointFilter, SkippedPoints};
use mrol_map::util::StopSignal;

/// Share of the time limit after which a search ends, and what it found is refined.
pub const SEARCH_SHARE: f64 = 0.9;
/// Candidates of a request that does not say.
pub const CANDIDATES_DEFAULT: usize = 5;
/// How long a search takes at most where the request does not say.
pub const TIME_LIMIT_DEFAULT: Duration = Duration::from_secs(10);

/// Where was this scan taken?
#[derive(Debug, Clone)]
pub struct LocalizationRequest {
    /// In the sensor frame; not finite = no return.
    pub points: PointCloud,
    /// What is known beforehand; its `candidates` are filled in where 0.
    pub query: LocalizationQuery,
    /// When to stop the search and answer with the best so far; [`TIME_LIMIT_DEFAULT`] without.
    pub time_limit: Option<Duration>,
}

/// The places that a scan fits.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalizationAnswer {
    /// Accepted only where rays believe the first candidate and no other place is as likely.
    pub verdict: Verdict,
    /// Why, in a sentence with the figures.
    pub reason: String,
    /// Distinct places, best first, as [`Localization::candidates`].
    pub candidates: Vec<CandidateAnswer>,
    /// Poses that the scan may have been taken at as well as at the first candidate: why it is ambiguous.
    pub rivals: Vec<Rival>,
    /// Every pose was considered: the way down was known, and the search ended by itself.
    pub exhaustive: bool,
    /// The search was stopped before its end.
    pub cut_short: bool,
    /// What the search and the refinement took.
    pub search_time: Duration,
    /// Points that were not finite, or at 0 0 0.
    pub points_skipped: usize,
    /// The version of the map that was searched.
    pub version: MapVersion,
}

/// A place that a scan fits.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateAnswer {
    /// Where the sensor was.
    pub map_from_sensor: Pose,
    /// Fraction of the points in occupied voxels of level 0.
    pub overlap: f64,
    /// Fraction of a sample of the points that lie on the map's surfaces.
    pub inliers: f64,
    /// How rays agree there; none where the search was stopped before they were asked.
    pub rays: Option<RayAgreement>,
}

impl LocalizationAnswer {
    /// The answer to a request of which some points were skipped.
    pub fn of(
        found: Localization,
        skipped: &SkippedPoints,
        search_time: Duration,
        version: MapVersion,
    ) -> Self {
        Self {
            verdict: found.verdict,
            reason: skipped.explain(found.verdict == Verdict::Accepted, &found.reason),
            candidates: found.candidates.iter().map(CandidateAnswer::from).collect(),
            rivals: found.rivals,
            exhaustive: found.exhaustive,
            cut_short: found.cut_short,
            search_time,
            points_skipped: skipped.total(),
            version,
        }
    }

    /// True when the first candidate is to be believed.
    pub fn accepted(&self) -> bool {
        self.verdict == Verdict::Accepted
    }
}

impl From<&Candidate> for CandidateAnswer {
    fn from(candidate: &Candidate) -> Self {
        Self {
            map_from_sensor: candidate.map_from_sensor,
            overlap: candidate.overlap,
            inliers: candidate.inliers,
            rays: candidate.agreement,
        }
    }
}

impl LocalizationRequest {
    /// The time limit of so many seconds.
    ///
    /// # Errors
    /// When the number is none, or negative.
    pub fn time_limit_of(seconds: f64) -> Result<Duration, ServiceError> {
        Duration::try_from_secs_f64(seconds).map_err(|_| {
            let message = format!("time_limit_s must be a number of seconds from 0 on, got {seconds}");
            ServiceError::new(Reason::BadTimeLimit, message)
        })
    }

    /// The request within the limits, with its defaults.
    ///
    /// # Errors
    /// Names what is beyond a limit.
    pub(super) fn within(mut self, limits: &Limits) -> Result<Self, ServiceError> {
        limits.check_points(self.points.len())?;
        let (wish, most) = (self.query.candidates, limits.localization_candidates_max);
        if wish > most {
            let message = format!("candidates is {wish}, localization_candidates_max is {most}");
            return Err(ServiceError::new(Reason::TooManyCandidates, message));
        }
        if wish == 0 {
            self.query.candidates = CANDIDATES_DEFAULT.min(most);
        }
        let time_max = Duration::from_secs_f64(limits.localization_time_max_s);
        let time_limit = self.time_limit.unwrap_or(TIME_LIMIT_DEFAULT.min(time_max));
        if time_limit > time_max {
            let message = format!("time_limit is {time_limit:?}, localization_time_max is {time_max:?}");
            return Err(ServiceError::new(Reason::TimeLimitTooLong, message));
        }
        self.time_limit = Some(time_limit);
        Ok(self)
    }
}

impl MapService {
    /// Says where in the map a scan was taken, with no guess. The search stops as soon as nobody awaits its answer.
    ///
    /// # Errors
    /// `InvalidArgument` for a scan without a usable point or with too many, a search box away from the map, a time
    /// limit or number of candidates beyond the limits; `FailedPrecondition` where the map is empty;
    /// `ResourceExhausted` where the map takes more than `localization_grid_bytes_max`, or there is no memory for the
    /// search; `NotFound`.
    pub async fn localize(
        &self,
        map: &MapName,
        request: LocalizationRequest,
    ) -> Result<LocalizationAnswer, ServiceError> {
        let work = async {
            let map = self.map(map).await?;
            let request = request.within(self.limits())?;
            let inner = Arc::clone(&self.inner);
            let search =
                move |stop: StopSignal<'_>| map.localize(&request, &inner.settings, &inner.budget, stop);
            self.inner.lanes.localization.run(&self.asker, search).await?
        };
        self.observed("Localize", Some(map), work, |_| Outcome::Read).await
    }
}

impl HostedMap {
    /// Searches the map for the scan's place, until the time is up or the caller gone.
    pub(crate) fn localize(
        &self,
        request: &LocalizationRequest,
        settings: &ServiceSettings,
        budget: &ResourceBudget,
        stop: StopSignal<'_>,
    ) -> Result<LocalizationAnswer, ServiceError> {
        let start = Instant::now();
        let limit = request.time_limit.unwrap_or(TIME_LIMIT_DEFAULT);
        let stop = stop.by(start + limit);
        let all = request.points.as_slice();
        let _copy = budget.reserve_transient(size_of_val(all) as u64, RESERVED_FOR)?;
        let skipped = SkippedPoints::of(all, &PointFilter::default());
        let points: Vec<Point> =
            all.iter().copied().filter(|point| PointFilter::default().keeps(*point)).collect();
        if points.is_empty() {
            // No settings of a robot say otherwise here.
            let (count, zeros) = (all.len(), skipped.zeros);
            let message = format!(
                "none of the scan's {count} points is a return: {zeros} are at 0 0 0, the others are not finite"
            );
            return Err(ServiceError::new(Reason::NoReturns, message));
        }
        let search = search_settings(settings.limits.localization_grid_bytes_max);
        let mut reserved: Vec<Reservation> = Vec::new();
        let mut refused = None;
        let supervision = &mut Supervision {
            stop,
            search_stop: stop.by(start + limit.mul_f64(SEARCH_SHARE)),
            progress: &mut |_| (),
            reserve: &mut |bytes| {
                let more = budget
                    .reserve_transient(bytes as u64, RESERVED_FOR)
                    .map(|reservation| reserved.push(reservation));
                more.map_err(|error| refused = Some(error)).is_ok()
            },
        };
        let (map, query) = (&self.map, &request.query);
        let found = localize_supervised(map, &points, query, &search, &settings.alignment, supervision);
        let found = found.map_err(|error| refused.unwrap_or_else(|| error.into()))?;
        // Time that is up is an answer. Nobody is there to hear it once the caller has gone.
        if stop.is_cancelled() {
            check_not_stopped(stop)?;
        }
        let version = self.version(found.version);
        Ok(LocalizationAnswer::of(found, &skipped, start.elapsed(), version))
    }
}

/// Name under which the memory of a search is reserved, for refusals.
const RESERVED_FOR: &str = "a search with no guess";

/// The search's settings where its grids may take `grid_bytes_max`: the cells that wait take half as much at most.
pub(super) fn search_settings(grid_bytes_max: usize) -> LocalizationSettings {
    let usual = LocalizationSettings::default();
    let cells_waiting_max = usual.cells_waiting_max.min(grid_bytes_max / 2 / BYTES_PER_CELL);
    LocalizationSettings { grid_bytes_max, cells_waiting_max, ..usual }
}

/// What a cell takes that waits to be divided, rounded up; while they move, those before them take half as much.
const BYTES_PER_CELL: usize = 64;

impl From<GravityError> for ServiceError {
    fn from(error: GravityError) -> Self {
        LocalizationQueryError::from(error).into()
    }
}

impl From<LocalizationQueryError> for ServiceError {
    fn from(error: LocalizationQueryError) -> Self {
        Self::new(Reason::BadQuery, error.to_string())
    }
}

impl From<LocalizationError> for ServiceError {
    fn from(error: LocalizationError) -> Self {
        let reason = match error {
            LocalizationError::EmptyMap => Reason::MapEmpty,
            LocalizationError::NothingInRange { .. } => Reason::ScanOutOfRange,
            LocalizationError::NothingThere { .. } => Reason::NothingThere,
            LocalizationError::NoMemory { .. } => Reason::MemoryFull,
            LocalizationError::TooLarge { .. } => Reason::SearchTooLarge,
        };
        Self::new(reason, error.to_string())
    }
}
