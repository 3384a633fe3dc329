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

    /// Lets a request in. The secret is taken out of its headers, so that nothing further in can show it; and what it says
    /// of the node that forwards it, which counts for the secret of the cluster alone. No page of a browser shows that.
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
}
