//! Which maps a handle on the service may name.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::error::{Reason, ServiceError};
use mrol_map::map::MapName;

/// The maps that a caller may name: all, or some.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum AllowedMaps {
    /// Every map, those to come among them.
    #[default]
    Every,
    /// Maps of these names, whether there are any or not.
    Only(Arc<BTreeSet<MapName>>),
}

/// A name that its caller may name. The catalog takes no other, so that no operation can leave the question out.
#[derive(Debug, Clone)]
pub(crate) struct Reachable(MapName);

impl AllowedMaps {
    /// No map at all.
    pub fn none() -> Self {
        Self::Only(Arc::default())
    }

    /// True where the map may be named.
    pub fn covers(&self, name: &MapName) -> bool {
        match self {
            Self::Every => true,
            Self::Only(names) => names.contains(name),
        }
    }

    /// Asks before anything is read or done for the request. The refusal tells nothing of whether there is such a map.
    ///
    /// # Errors
    /// `PermissionDenied` where the map may not be named.
    pub fn permit(&self, name: &MapName) -> Result<(), ServiceError> {
        self.check(name).map(drop)
    }

    pub(crate) fn check(&self, name: &MapName) -> Result<Reachable, ServiceError> {
        match self {
            Self::Only(names) if !names.contains(name) => {
                let names: Vec<_> = names.iter().map(MapName::as_str).collect();
                let message = format!("the key is not for map {name}: it is for {}", names.join(", "));
                Err(ServiceError::new(Reason::MapNotAllowed, message))
            }
            _ => Ok(Reachable(name.clone())),
        }
    }
}

impl FromIterator<MapName> for AllowedMaps {
    fn from_iter<I: IntoIterator<Item = MapName>>(names: I) -> Self {
        Self::Only(Arc::new(names.into_iter().collect()))
    }
}

impl Reachable {
    pub(crate) fn name(&self) -> &MapName {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_out_of_reach_is_refused_with_what_is_within() {
        let name = |name| MapName::new(name).unwrap();
        let some: AllowedMaps = [name("a"), name("b")].into_iter().collect();
        assert_eq!(some.check(&name("b")).unwrap().name(), &name("b"));
        let refused = some.check(&name("c")).unwrap_err();
        assert_eq!(refused.reason, Reason::MapNotAllowed);
        assert_eq!(refused.message, "the key is not for map c: it is for a, b");
        assert!(AllowedMaps::Every.covers(&name("c")) && !AllowedMaps::none().covers(&name("c")));
    }
}
