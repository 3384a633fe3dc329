//! `mrol insert` of a robot's log.

use std::path::Path;
use std::time::Duration;

use tokio::sync::mpsc;

use super::attempts::{Attempts, is_passing};
use super::command::Insert;
use super::pace::Pace;
use super::report::{FailedLine, ScanLine};
use super::sending::{Answers, SCANS_AHEAD, advice, concerns_all};
use crate::cli::alignment_options::GuessName;
use crate::cli::log::{LogFile, LogScans, name_of_stamp};
use mrol::console::{CliError, Output};
use mrol_client::{Client, ClientError};
use mrol_logs::sequence::{LoggedScan, Odometer};
use mrol_map::map::SessionName;
use mrol_map::mapping::Guess;
use mrol_service::{PointTimes, ScanAnswer, ScanRequest, TimeReference};

/// Characters of a scan's name: a stamp of this century, in milliseconds.
const NAME_WIDTH: usize = 14;

impl Insert {
    /// Sends the clouds of a log, one after the other: the guess of each counts from the last one that was accepted.
    pub(super) async fn run_log(&self, path: &Path, output: Output) -> Result<(), CliError> {
        self.refuse_options_of_files()?;
        let (log, scans) = LogFile::open(path, &self.log, &output)?;
        let session = match &self.session {
            Some(session) => session.clone(),
            None => SessionName::new(&log.session(&scans)).map_err(CliError::failed)?,
        };
        let client = self.map.server.connect().await?;
        self.survey(&client, &[], &output).await?;
        // Who may only insert is not told.
        let begins_map = client.map_info(&self.map.name).await.is_ok_and(|info| info.is_empty());
        let sent = self.sent_before(&client, &session).await;
        let mut sending = LogSending {
            insert: self,
            client: &client,
            path,
            begins_map,
            done_ns: sent.done_ns,
            elsewhere_ns: sent.elsewhere_ns,
            session,
            odometer: Odometer::default(),
            counted: Answers::default(),
            pace: self.real_time.then(Pace::default),
            output: output.with_bar_of_bytes(log.bytes),
        };
        if let Some(done_ns) = sending.done_ns {
            let stamp = name_of_stamp(done_ns);
            sending.output.note(format!("the map has this log up to {stamp}: it goes on from there"));
        }
        let (sender, receiver) = mpsc::channel(SCANS_AHEAD);
        let reader_output = sending.output.clone();
        let reader = tokio::task::spawn_blocking(move || read(scans, &sender, &reader_output));
        let sent = sending.run(receiver).await;
        // What is read has ended, or nobody receives it any more.
        let read = reader.await.map_err(CliError::failed)?;
        sending.output.clear_bar();
        sent?;
        read?;
        sending.counted.result()
    }

    /// What the map has of this robot.
    async fn sent_before(&self, client: &Client, session: &SessionName) -> SentBefore {
        // Who may only insert is not told: the server then answers scans again that it has.
        let Ok(trajectory) = client.trajectory(&self.map.name, Some(&self.robot)).await else {
            return SentBefore::default();
        };
        let (of_log, others): (Vec<_>, Vec<_>) =
            trajectory.poses.iter().partition(|pose| pose.session == *session);
        let is_told = self.session.is_some() || self.guess.is_some();
        let elsewhere_ns = others.iter().filter_map(|pose| pose.timestamp_ns).max();
        SentBefore {
            done_ns: of_log.last().and_then(|pose| pose.timestamp_ns),
            elsewhere_ns: elsewhere_ns.filter(|_| !is_told),
        }
    }

    fn refuse_options_of_files(&self) -> Result<(), CliError> {
        let given = [
            ("--poses", self.truth.is_some()),
            ("--origin", self.origin.is_some()),
            ("--first-scan-id", self.first_scan_id.is_some()),
        ];
        match given.into_iter().chain(self.scan_files.given()).find(|(_, is_given)| *is_given) {
            Some((option, _)) => Err(CliError::usage(format!("{option}: for scan files, not for a log"))),
            None => Ok(()),
        }
    }
}

/// Reads the scans of a log until nobody receives them.
fn read(
    mut scans: LogScans,
    sender: &mpsc::Sender<(LoggedScan, u64)>,
    output: &Output,
) -> Result<(), CliError> {
    while let Some(scan) = scans.next(output)? {
        if sender.blocking_send(scan).is_err() {
            break;
        }
    }
    Ok(())
}

/// What a map has of a robot before a log of it is sent.
#[derive(Debug, Clone, Copy, Default)]
struct SentBefore {
    /// The stamp of the log's last scan that the map keeps, which an earlier start of this command sent.
    done_ns: Option<i64>,
    /// The stamp of the last scan of another session.
    elsewhere_ns: Option<i64>,
}

/// The scans of a log on their way.
struct LogSending<'a> {
    insert: &'a Insert,
    client: &'a Client,
    path: &'a Path,
    /// True where the map was empty before the log's first scan.
    begins_map: bool,
    session: SessionName,
    /// The robot's last scan in the map that is of another session; none where options say what to make of it.
    elsewhere_ns: Option<i64>,
    /// Scans up to the one of this stamp, in the order of the log, were sent by an earlier start of the command; none
    /// once it was met.
    done_ns: Option<i64>,
    odometer: Odometer,
    counted: Answers,
    /// Where the log is played as fast as it was recorded.
    pace: Option<Pace>,
    output: Output,
}

impl LogSending<'_> {
    async fn run(&mut self, mut scans: mpsc::Receiver<(LoggedScan, u64)>) -> Result<(), CliError> {
        let filter = self.insert.points.filter().map_err(CliError::usage)?;
        let (mut is_first, mut taken) = (true, 0usize);
        while let Some((mut scan, position)) = scans.recv().await {
            self.output.advance_to(position);
            taken += 1;
            if let Some(done_ns) = self.done_ns {
                self.odometer.accepted(&scan);
                self.done_ns = self.done_ns.filter(|_| scan.stamp_ns != done_ns);
                is_first = false;
                continue;
            }
            if !scan.points.iter().any(|&point| filter.keeps(point)) {
                self.output.note(format!("the cloud of {} has no return", name_of_stamp(scan.stamp_ns)));
                continue;
            }
            if is_first {
                self.check_is_later(&scan)?;
            }
            let request = self.request(&mut scan, is_first)?;
            if let Some(pace) = &mut self.pace {
                pace.wait(scan.stamp_ns).await;
            }
            is_first = !self.send(&scan, request).await? && is_first;
        }
        if let Some(done_ns) = self.done_ns.filter(|_| taken > 0) {
            return Err(CliError::failed(format!(
                "{}: the map has the cloud of {} in session {}, which these options do not take, so that \
                 nothing is known to be new: start it with the options of before, or with another --session",
                self.path.display(),
                name_of_stamp(done_ns),
                self.session
            )));
        }
        if let Some(pace) = self.pace.as_ref().filter(|_| self.counted.answered > 0) {
            self.output.note(pace.lateness().to_string());
        }
        match taken {
            0 => Err(CliError::failed(format!(
                "{}: no cloud of the log is taken: see the notes above, and --from, --to",
                self.path.display()
            ))),
            _ => Ok(()),
        }
    }

    /// Refuses a log that begins before the robot's last scan in the map: that says nothing of where it begins.
    fn check_is_later(&self, first: &LoggedScan) -> Result<(), CliError> {
        let Some(last_ns) = self.elsewhere_ns.filter(|last_ns| *last_ns >= first.stamp_ns) else {
            return Ok(());
        };
        let Insert { map, robot, .. } = self.insert;
        Err(CliError::failed(format!(
            "{}: its first cloud is of {}, and map {} has scans of robot {robot} up to {}: if they are of this log, the map \
             has it already; if they are another robot's, give this one another name by --robot; else say by --guess \
             where the log begins",
            self.path.display(),
            name_of_stamp(first.stamp_ns),
            map.name,
            name_of_stamp(last_ns)
        )))
    }

    fn request(&self, scan: &mut LoggedScan, is_first: bool) -> Result<ScanRequest, CliError> {
        let insert = self.insert;
        let told = insert.guess.filter(|_| is_first).map(Guess::Pose);
        let next = insert.next_guess.unwrap_or(GuessName::ConstantVelocity).into();
        let first = || scan.first_pose().filter(|_| is_first && self.begins_map).map(Guess::Pose);
        let guess = told.or_else(|| self.odometer.guess(scan)).or_else(first);
        let points = std::mem::take(&mut scan.points);
        let times_s = scan.times_s.take();
        Ok(ScanRequest {
            session: self.session.clone(),
            scan_id: Some(scan.stamp_ns as u64),
            timestamp_ns: Some(scan.stamp_ns),
            point_times: times_s.map(|times_s| PointTimes::new(&times_s, TimeReference::Timestamp)),
            // A robot that drives accelerates, which is no direction of gravity.
            gravity: scan.gravity.filter(|_| is_first),
            guess: guess.unwrap_or(if is_first { Guess::Last } else { next }),
            at_guess: told.is_some() && insert.at_guess,
            force: insert.force,
            recover: insert.recover,
            carve: insert.carve,
            method: insert.alignment.method(),
            filter: insert.points.filter().map_err(CliError::usage)?,
            sensor: insert.points.sensor(),
            ..ScanRequest::new(insert.robot.clone(), points.into())
        })
    }

    /// Sends a scan until it is answered, and prints the answer; true where the map took it.
    async fn send(&mut self, scan: &LoggedScan, request: ScanRequest) -> Result<bool, CliError> {
        let name = name_of_stamp(scan.stamp_ns);
        match self.answer(&name, request).await? {
            Ok(answer) => {
                if self.counted.answered == 0 {
                    self.output.say(ScanLine::head(NAME_WIDTH))?;
                }
                self.output.print(&ScanLine::of(name, &answer, NAME_WIDTH))?;
                self.counted.answered += 1;
                self.counted.refused += usize::from(!answer.accepted);
                if answer.accepted {
                    self.odometer.accepted(scan);
                }
                Ok(answer.accepted)
            }
            Err(error) => {
                self.output.print(&FailedLine { scan: name, error: error.to_string() })?;
                self.counted.answered += 1;
                self.counted.failed += 1;
                Ok(false)
            }
        }
    }

    /// The answer to a scan, which is sent again for as long as the options say; or why this scan alone has none.
    async fn answer(
        &self,
        name: &str,
        request: ScanRequest,
    ) -> Result<Result<ScanAnswer, ClientError>, CliError> {
        let mut attempts = Attempts::new(Duration::from_secs(self.insert.patience.into()));
        loop {
            let error = match self.client.insert_scan(&self.insert.map.name, request.clone()).await {
                Ok(answer) => return Ok(Ok(answer)),
                Err(error) => error,
            };
            if !is_passing(&error) {
                return match &error {
                    ClientError::Refused { .. } if !concerns_all(&error) => Ok(Err(error)),
                    _ => Err(CliError::failed(format!("{name}: {error}{}", advice(&error)))),
                };
            }
            if attempts.is_first() {
                self.output.note(format!("{error}; going on with {name} once that is possible"));
            }
            if !attempts.pause().await {
                return Err(CliError::failed(format!(
                    "{name}: {error}; {} scans were answered. The same command goes on from there, and adds no scan twice",
                    self.counted.answered
                )));
            }
        }
    }
}
