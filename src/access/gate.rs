//! Where every request comes in.

use axum::http::header::AUTHORIZATION;
use axum::http::{Extensions, HeaderMap, Request};

use super::caller::Caller;
use super::forwarding::Forwarding;
use super::operation::Operation;
use super::peer::{Peer, asker_of};
use super::rules::Access;
use super::secret::Secret;
use mrol_map::map::CallerName;
use mrol_service::{MapService, Reason, ServiceError};

/// The only holder of a service that reaches every map. Handlers get theirs of [`Gate::authorize`], so that none can
/// reach more than its caller may.
#[derive(Debug, Clone)]
pub struct Gate {
    access: Access,
    service: MapService,
}

/// What a request that was let in is answered with.
#[derive(Debug, Clone)]
pub struct Authorized {
    /// The caller.
    pub caller: Caller,
    /// The maps that the caller may name.
    pub service: MapService,
}

impl Authorized {
    /// What a request was let in with; the layers around the handlers have put it there.
    ///
    /// # Errors
    /// `Internal` where nobody asked: a handler was served past them.
    pub fn of(extensions: &Extensions) -> Result<&Self, ServiceError> {
        extensions.get().ok_or_else(|| {
            let message = "nobody asked who may do this: a defect of the server";
            ServiceError::new(Reason::NotAuthorized, message)
        })
    }
}

impl Gate {
    /// Lets in to `service` whom `access` allows.
    pub fn new(access: Access, service: MapService) -> Self {
        Self { access, service }
    }

    /// Lets a request in. The secret is taken out of its headers, so that nothing further in can show it; and what it
    /// says of the node that forwards it, which counts for the secret of the cluster alone. No page of a browser shows
    /// that.
    ///
    /// # Errors
    /// `Unauthenticated` and `PermissionDenied`, as [`Access::authorize`] and [`Access::check_site`] say.
    pub fn authorize<B>(
        &self,
        operation: Operation,
        request: &mut Request<B>,
    ) -> Result<Authorized, ServiceError> {
        let secret = taken_from(request.headers_mut());
        let forwarding = Forwarding::taken_from(request.headers_mut());
        let is_of_node = self.access.is_of_cluster(secret.as_ref());
        let caller = if is_of_node {
            let over_grpc = operation.grpc() == Some(request.uri().path());
            self.access.authorize_forwarded(operation, over_grpc, &forwarding)?
        } else {
            self.access.check_site(operation, request)?;
            self.access.authorize(operation, secret.as_ref())?
        };
        let name = caller.name().map(CallerName::new).transpose()?;
        let asker = asker_of(caller.name(), request.extensions().get::<Peer>());
        let service = self.service.limited_to(name, caller.allowed_maps().clone(), caller.scans());
        let service = service.asked_by(asker);
        // Where nobody shows anything nodes do not either. That it is taken no further gains nobody anything.
        let is_forwarded = is_of_node || (forwarding.node.is_some() && self.access.asks_for_nothing());
        let service = if is_forwarded { service.forwarded() } else { service };
        Ok(Authorized { caller, service })
    }

    /// Asks whether a request that is for no operation names this server.
    ///
    /// # Errors
    /// `PermissionDenied` where it does not.
    pub fn check_host<B>(&self, request: &Request<B>) -> Result<(), ServiceError> {
        self.access.check_host(request)
    }
}

/// The secret of `authorization: Bearer <secret>`.
fn taken_from(headers: &mut HeaderMap) -> Option<Secret> {
    let value = headers.remove(AUTHORIZATION)?;
    let (scheme, secret) = value.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| Secret::new(secret.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::access::expiry::Expiry;
    use crate::access::key::{Key, KeyName};
    use crate::access::key_file::add_to_file;
    use crate::access::scope::Scope;
    use mrol_map::map::{MapName, RobotName};
    use mrol_service::{AllowedMaps, ServiceSettings};
    use mrol_store::OpeningProgress;

    const OF_CLUSTER: &str = "mrol_0123456789abcdef0123456789abcdef";

    fn service() -> MapService {
        MapService::open(ServiceSettings::default(), &OpeningProgress::default()).unwrap()
    }

    /// Where these keys count, each by the secret `secret-of-NAME`, and the secret of the cluster.
    fn gate(keys: impl IntoIterator<Item = Key>) -> Gate {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("keys.toml");
        keys.into_iter().for_each(|key| add_to_file(&file, &key).unwrap());
        let access = Access::by_keys_of(&file, true).unwrap();
        Gate::new(access.with_cluster_secret(&Secret::new(OF_CLUSTER)), service())
    }

    fn key(name: &str, scope: Scope) -> Key {
        let digest = Secret::new(format!("secret-of-{name}")).digest();
        Key::new(KeyName::new(name).unwrap(), digest, scope, AllowedMaps::Every)
    }

    fn key_of_each_scope() -> impl Iterator<Item = Key> {
        Scope::ALL.into_iter().map(|scope| key(scope.as_str(), scope))
    }

    /// A gRPC call with this secret, and these headers of a node.
    fn call(operation: Operation, secret: Option<&str>, headers: &[(&'static str, &str)]) -> Request<()> {
        let mut request = Request::post(operation.grpc().unwrap_or("/none")).header("host", "localhost");
        if let Some(secret) = secret {
            request = request.header(AUTHORIZATION, format!("Bearer {secret}"));
        }
        let request = headers.iter().fold(request, |request, (name, value)| request.header(*name, *value));
        request.body(()).unwrap()
    }

    /// What a node asks for the holder of a key.
    fn forwarded(gate: &Gate, operation: Operation, caller: &str) -> Result<Authorized, Reason> {
        let headers = [("mrol-node", "b"), ("mrol-caller", caller)];
        let authorized = gate.authorize(operation, &mut call(operation, Some(OF_CLUSTER), &headers));
        authorized.map_err(|refusal| refusal.reason)
    }

    fn refused<T>(answer: Result<T, ServiceError>) -> Reason {
        answer.map(drop).unwrap_err().reason
    }

    #[test]
    fn a_secret_is_taken_out_of_the_headers() {
        let taken = |value: &'static str| {
            let mut headers = HeaderMap::from_iter([(AUTHORIZATION, value.parse().unwrap())]);
            let secret = taken_from(&mut headers);
            assert!(headers.is_empty());
            secret.map(|secret| secret.reveal().to_owned())
        };
        assert_eq!(taken("Bearer mrol_1").as_deref(), Some("mrol_1"));
        assert_eq!(taken("bearer  mrol_1 ").as_deref(), Some("mrol_1"));
        for none in ["Basic bXJvbA==", "mrol_1", "Bearer"] {
            assert_eq!(taken(none), None, "{none}");
        }
    }

    #[test]
    fn a_node_gets_for_a_caller_what_the_caller_would() {
        let gate = gate(key_of_each_scope());
        for scope in Scope::ALL {
            for &operation in Operation::ALL.iter().filter(|operation| operation.is_asked_by_nodes()) {
                let secret = format!("secret-of-{scope}");
                let itself = gate.authorize(operation, &mut call(operation, Some(&secret), &[]));
                let by_node = forwarded(&gate, operation, scope.as_str());
                match (itself, by_node) {
                    (Ok(itself), Ok(by_node)) => {
                        let (itself, by_node) = (itself.caller, by_node.caller);
                        assert_eq!(by_node.name(), Some(scope.as_str()));
                        assert_eq!(by_node.scans(), itself.scans());
                        // Both count by the same rates.
                        let allowances = (by_node.allowance().unwrap(), itself.allowance().unwrap());
                        assert!(std::sync::Arc::ptr_eq(allowances.0, allowances.1));
                    }
                    (Err(itself), Err(by_node)) => assert_eq!(itself.reason, by_node),
                    (itself, by_node) => panic!("{operation:?} by {scope}: {itself:?}, {by_node:?}"),
                }
            }
        }
    }

    #[test]
    fn a_node_names_no_key_that_does_not_count_here_and_reaches_no_more_maps_and_robots_than_it() {
        let (own_map, own_robot) = (MapName::new("own").unwrap(), RobotName::new("r1").unwrap());
        let for_one = Key::new(
            KeyName::new("one").unwrap(),
            Secret::new("1").digest(),
            Scope::Insert,
            [own_map.clone()].into_iter().collect(),
        );
        let past = Expiry::parse("2020-01-31").unwrap();
        let gate = gate([for_one.for_robots([own_robot.clone()]), key("old", Scope::Admin).until(past)]);
        let Authorized { caller, .. } = forwarded(&gate, Operation::InsertScan, "one").unwrap();
        assert_eq!(*caller.allowed_maps(), [own_map].into_iter().collect());
        assert_eq!(caller.scans().robots.unwrap().iter().collect::<Vec<_>>(), [&own_robot]);
        assert_eq!(forwarded(&gate, Operation::DeleteVoxels, "one").unwrap_err(), Reason::ScopeTooSmall);
        assert_eq!(forwarded(&gate, Operation::InsertScan, "old").unwrap_err(), Reason::KeyExpired);
        for unknown in ["two", "", "a b", "secret-of-old"] {
            assert_eq!(forwarded(&gate, Operation::InsertScan, unknown).unwrap_err(), Reason::KeyUnknown);
        }
    }

    #[test]
    fn the_secret_of_the_cluster_is_for_its_nodes_and_for_what_they_forward() {
        let gate = gate(key_of_each_scope());
        let ask = |operation, headers: &[_]| {
            refused(gate.authorize(operation, &mut call(operation, Some(OF_CLUSTER), headers)))
        };
        let caller = ("mrol-caller", "admin");
        assert_eq!(ask(Operation::InsertScan, &[]), Reason::KeyUnknown);
        assert_eq!(ask(Operation::InsertScan, &[caller]), Reason::KeyUnknown);
        assert_eq!(ask(Operation::InsertScan, &[("mrol-node", "Not A Node"), caller]), Reason::KeyUnknown);
        assert_eq!(ask(Operation::InsertScan, &[("mrol-node", "b")]), Reason::KeyMissing);
        for &operation in Operation::ALL.iter().filter(|operation| !operation.is_asked_by_nodes()) {
            assert_eq!(ask(operation, &[("mrol-node", "b"), caller]), Reason::ScopeTooSmall, "{operation:?}");
        }
        // Over HTTP nodes ask nothing.
        let mut over_http = Request::post("/v1/maps/a/scans")
            .header(AUTHORIZATION, format!("Bearer {OF_CLUSTER}"))
            .header("mrol-node", "b")
            .header("mrol-caller", "admin")
            .body(())
            .unwrap();
        assert_eq!(refused(gate.authorize(Operation::InsertScan, &mut over_http)), Reason::ScopeTooSmall);
    }

    #[test]
    fn who_has_a_key_gains_nothing_by_the_headers_of_a_node() {
        let gate = gate(key_of_each_scope());
        let forged = [("mrol-node", "b"), ("mrol-caller", "admin")];
        for scope in Scope::ALL {
            let secret = format!("secret-of-{scope}");
            for &operation in Operation::ALL {
                let ask = |headers: &[_]| {
                    let mut request = call(operation, Some(&secret), headers);
                    let authorized = gate.authorize(operation, &mut request);
                    assert!(!request.headers().keys().any(|name| name.as_str().starts_with("mrol-")));
                    let caller = authorized.map(|authorized| authorized.caller);
                    caller.map(|it| it.name().map(str::to_owned)).map_err(|refusal| refusal.reason)
                };
                assert_eq!(ask(&forged), ask(&[]), "{operation:?} by {scope}");
            }
        }
        for secret in [None, Some("mrol_0123456789abcdef0123456789abcdeF"), Some("")] {
            let asked =
                gate.authorize(Operation::InsertScan, &mut call(Operation::InsertScan, secret, &forged));
            assert!(matches!(refused(asked), Reason::KeyMissing | Reason::KeyUnknown));
        }
    }

    #[test]
    fn where_no_keys_are_asked_for_nodes_ask_for_anybody() {
        let with_secret = Access::open().with_cluster_secret(&Secret::new(OF_CLUSTER));
        let gate = Gate::new(with_secret, service());
        let (node, operation) = (("mrol-node", "b"), Operation::DeleteVoxels);
        let caller_of = |secret, headers: &[_]| {
            let authorized = gate.authorize(operation, &mut call(operation, secret, headers));
            authorized.map(|it| it.caller.name().map(str::to_owned)).map_err(|refusal| refusal.reason)
        };
        assert_eq!(caller_of(Some(OF_CLUSTER), &[node]), Ok(None));
        // A key that only the other node knows: their settings differ.
        assert_eq!(caller_of(Some(OF_CLUSTER), &[node, ("mrol-caller", "a")]), Err(Reason::KeyUnknown));
        assert_eq!(caller_of(None, &[node, ("mrol-caller", "a")]), Ok(None));
        // Another site's page does not get in by saying that it is a node, and a node by its own name does.
        let named = |secret| {
            let mut request = call(operation, secret, &[node]);
            request.headers_mut().insert("host", "node-2:7334".parse().unwrap());
            gate.authorize(operation, &mut request).map(drop).map_err(|refusal| refusal.reason)
        };
        assert_eq!(named(None), Err(Reason::HostNotAllowed));
        assert_eq!(named(Some(OF_CLUSTER)), Ok(()));
    }
}
