//! The attackers as a process of their own.

use std::process::Stdio;

use tokio::io::{AsyncBufReadExt, BufReader, Lines};
use tokio::process::{Child, ChildStdout, Command};

use super::aim::Aim;
use super::assault::Damage;
use super::kind::Attack;
use crate::fleet::error::FleetError;
use crate::fleet::process::own_program;

/// The lowest priority that there is.
const NICEST: &str = "19";

/// Attackers in a process of the lowest priority, so that it is the server that others wait for. Killed when dropped.
pub(crate) struct Assailants {
    child: Child,
    told: Lines<BufReader<ChildStdout>>,
}

impl Assailants {
    /// Starts `attacks`; returns when they begin.
    pub(crate) async fn start(
        aim: &Aim,
        attacks: &[Attack],
        seconds: f64,
        seed: u64,
    ) -> Result<Self, FleetError> {
        let names: Vec<String> = attacks.iter().map(|attack| attack.name()).collect();
        let mut child = Command::new("nice")
            .args(["-n", NICEST])
            .arg(own_program()?)
            .args(["attackers", "--attacks", &names.join(",")])
            .args(["--grpc", &aim.grpc, "--http", &aim.http])
            .args(["--shared", aim.shared.as_str(), "--large", aim.large.as_str(), "--own", aim.own.as_str()])
            .args(["--seconds", &seconds.to_string(), "--seed", &seed.to_string()])
            // Other users of the machine see options.
            .env(Aim::READER, &aim.reader)
            .env(Aim::INSERTER, &aim.inserter)
            .stdout(Stdio::piped())
            .kill_on_drop(true)
            .spawn()
            .map_err(|error| FleetError::failed(format!("no attackers: {error}")))?;
        let output = child.stdout.take().ok_or_else(|| FleetError::failed("the attackers say nothing"))?;
        let mut told = BufReader::new(output).lines();
        told.next_line().await.map_err(FleetError::failed)?;
        Ok(Self { child, told })
    }

    /// Waits for their end; what became of each attack.
    pub(crate) async fn end(&mut self) -> Result<Vec<Damage>, FleetError> {
        let mut damages = Vec::new();
        while let Some(line) = self.told.next_line().await.map_err(FleetError::failed)? {
            damages.push(serde_json::from_str(&line).map_err(FleetError::failed)?);
        }
        match self.child.wait().await.map_err(FleetError::failed)? {
            status if status.success() => Ok(damages),
            status => Err(FleetError::failed(format!("the attackers ended with {status}"))),
        }
    }
}
