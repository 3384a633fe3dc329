//! A table of the file of keys, and the keys that it makes.

use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};
use toml::value::Datetime;

use crate::access::allowance::KeyLimits;
use crate::access::expiry::Expiry;
use crate::access::key::{Key, KeyName};
use crate::access::scope::Scope;
use crate::access::secret::Digest;
use mrol_map::map::{MapName, RobotName};
use mrol_service::AllowedMaps;

/// A key as its file holds it; the fields are described at the module's head.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeyEntry {
    /// The name of the key's holder.
    pub name: String,
    /// The hash of its secret.
    pub(super) sha256: String,
    /// What it is for.
    pub scope: String,
    /// The maps that it is for; none = every map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maps: Option<Vec<String>>,
    /// The robots whose scans it may send and undo; none = every robot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robots: Option<Vec<String>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    expires: Option<Datetime>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    requests_per_s_max: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    burst_max: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    requests_at_once_max: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) former_sha256: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    former_expires: Option<Datetime>,
}

impl KeyEntry {
    /// The entry of a key.
    pub(super) fn of(key: &Key) -> Self {
        let maps = match &key.allowed_maps {
            AllowedMaps::Every => None,
            AllowedMaps::Only(names) => Some(names.iter().map(MapName::to_string).collect()),
        };
        let robots = key.robots.as_ref().map(|robots| robots.iter().map(|r| r.as_str().to_owned()).collect());
        let limits = key.allowance.limits;
        Self {
            name: key.name.to_string(),
            sha256: key.digest.to_string(),
            scope: key.scope.to_string(),
            maps,
            robots,
            expires: key.expires.and_then(|expires| expires.to_string().parse().ok()),
            requests_per_s_max: limits.requests_per_s_max.map(NonZeroU32::get),
            burst_max: limits.burst_max.map(NonZeroU32::get),
            requests_at_once_max: limits.requests_at_once_max.map(NonZeroU32::get),
            former_sha256: None,
            former_expires: None,
        }
    }

    /// Until when it counts.
    pub fn expires(&self) -> Option<Expiry> {
        self.expires.as_ref().and_then(|time| Expiry::parse(&time.to_string()))
    }

    /// Until when the secret before the last rotation counts, where there is one.
    pub fn former_expires(&self) -> Option<Expiry> {
        self.former_expires.as_ref().and_then(|time| Expiry::parse(&time.to_string()))
    }

    /// The key of its secret, and that of the one before.
    pub(super) fn keys(&self) -> Result<(Key, Option<Key>), &'static str> {
        let name = KeyName::new(&self.name).ok_or("name must be 1 to 64 of [A-Za-z0-9_.-]")?;
        let digest =
            Digest::parse(&self.sha256).ok_or("sha256 must be the 64 hexadecimal digits of a hash")?;
        let scope = Scope::ALL.into_iter().find(|scope| scope.as_str() == self.scope);
        let scope = scope.ok_or("scope must be read, insert, write or admin")?;
        let allowed_maps = self.maps.as_deref().map_or(Ok(AllowedMaps::Every), allowed_maps_of)?;
        let mut key = Key::new(name, digest, scope, allowed_maps).with_limits(self.limits()?);
        if let Some(robots) = &self.robots {
            key = key.for_robots(robots_of(robots)?);
        }
        if self.expires.is_some() {
            key = key.until(self.expires().ok_or(BAD_EXPIRES)?);
        }
        let former = self.former(&key)?;
        Ok((key, former))
    }

    fn former(&self, key: &Key) -> Result<Option<Key>, &'static str> {
        let Some(digest) = &self.former_sha256 else {
            let nothing_expires = self.former_expires.is_none();
            return nothing_expires
                .then_some(None)
                .ok_or("former_expires is of no use without former_sha256");
        };
        let digest =
            Digest::parse(digest).ok_or("former_sha256 must be the 64 hexadecimal digits of a hash")?;
        if self.former_expires.is_some() && self.former_expires().is_none() {
            return Err("former_expires must be a date or a time with an offset: 2027-01-31T12:00:00Z");
        }
        Ok(Some(key.former(digest, self.former_expires())))
    }

    fn limits(&self) -> Result<KeyLimits, &'static str> {
        let number = |number: Option<u32>| match number.map(NonZeroU32::new) {
            Some(None) => {
                Err("requests_per_s_max, burst_max and requests_at_once_max must be 1 to 4294967295")
            }
            Some(number) => Ok(number),
            None => Ok(None),
        };
        let limits = KeyLimits {
            requests_per_s_max: number(self.requests_per_s_max)?,
            burst_max: number(self.burst_max)?,
            requests_at_once_max: number(self.requests_at_once_max)?,
        };
        if limits.burst_max.is_some() && limits.requests_per_s_max.is_none() {
            return Err("burst_max is of no use without requests_per_s_max");
        }
        Ok(limits)
    }
}

const BAD_EXPIRES: &str = "expires must be a date or a time with an offset: 2027-01-31T12:00:00Z";

fn allowed_maps_of(maps: &[String]) -> Result<AllowedMaps, &'static str> {
    if maps.is_empty() {
        return Err("maps must name a map; without it the key is for every map");
    }
    let names = maps.iter().map(|name| MapName::new(name)).collect::<Result<_, _>>();
    names.map_err(|_| "maps must be names of maps: [a-z0-9][a-z0-9_-]{0,63}")
}

fn robots_of(robots: &[String]) -> Result<Vec<RobotName>, &'static str> {
    if robots.is_empty() {
        return Err("robots must name a robot; without it the key is for every robot");
    }
    let names = robots.iter().map(|name| RobotName::new(name)).collect::<Result<_, _>>();
    names.map_err(|_| "robots must be names of robots: 1 to 64 of [A-Za-z0-9_.-]")
}
