//! What a page of somebody else can make a browser send.

use mrol::access::{Operation, Scope};
use mrol::wire::pb;
use reqwest::{Method, StatusCode};
use serde_json::Value;
use tonic::codegen::http;
use tonic::transport::Channel;
use tonic::{Code, Request};
use tower::ServiceExt;

use super::keyring::Guarded;
use super::requests::body;
use crate::support::daemon::{Daemon, client};

/// The status and the reason of a request with more headers.
async fn asked(
    daemon: &Daemon,
    (method, path): (&str, &str),
    headers: &[(&str, &str)],
    body: Option<Value>,
) -> (u16, String, String) {
    let mut request = client().request(method.parse::<Method>().unwrap(), daemon.url(path));
    for (name, value) in headers {
        request = request.header(*name, *value);
    }
    if let Some(body) = body {
        request = request.json(&body);
    }
    let answer = request.send().await.unwrap();
    let status = answer.status();
    // What was let in may answer for as long as somebody reads.
    let error: Value =
        if status.is_success() { Value::Null } else { answer.json().await.unwrap_or_default() };
    let status = status.as_u16();
    let text = |field: &str| error[field].as_str().unwrap_or_default().to_owned();
    (status, text("reason"), text("detail"))
}

#[tokio::test(flavor = "multi_thread")]
async fn without_keys_a_server_answers_to_its_own_names_alone() {
    let daemon = Daemon::start_with(|config| config.access.hosts = vec!["mrol".into()]).await;
    for path in ["/v1/maps", "/livez", "/readyz", "/metrics", "/nowhere"] {
        let (status, reason, message) =
            asked(&daemon, ("GET", path), &[("host", "evil.example:7333")], None).await;
        assert_eq!((status, reason.as_str()), (421, "host_not_allowed"), "{path}");
        assert!(message.contains("access.hosts") && message.contains("evil.example"), "{message}");
    }
    for host in ["localhost", "127.0.0.1:1", "127.1.2.3", "[::1]:7333", "mrol:7333"] {
        let (status, ..) = asked(&daemon, ("GET", "/v1/maps"), &[("host", host)], None).await;
        assert_eq!(status, 200, "{host}");
    }
    // A page can show no key, so that with keys every name will do.
    let (guarded, ()) = Guarded::start_with(|_| ()).await;
    let (status, reason, _) = asked(&guarded.daemon, ("GET", "/v1/maps"), &[("host", "robot-7")], None).await;
    assert_eq!((status, reason.as_str()), (401, "key_missing"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_of_another_site_changes_nothing_with_keys_or_without() {
    let (guarded, key) = Guarded::start_with(|keys| keys.add("page", Scope::Admin, None)).await;
    guarded.make_map("own").await;
    let open = Daemon::start().await;
    open.make_map("own").await;
    let secret = format!("Bearer {}", key.reveal());
    let mut changing = 0;
    for &operation in Operation::ALL {
        let Some(route) = operation.route() else { continue };
        let path = route.path.replace("{map}", "own").replace("{name}", "dock").replace("{file}", "main.js");
        for foreign in
            [("origin", "http://evil.example"), ("origin", "null"), ("sec-fetch-site", "cross-site")]
        {
            for (daemon, headers) in
                [(&open, vec![foreign]), (&guarded.daemon, vec![foreign, ("authorization", secret.as_str())])]
            {
                let (status, reason, _) =
                    asked(daemon, (route.method, &path), &headers, body(operation)).await;
                let refused = (status, reason.as_str()) == (403, "cross_site");
                assert_eq!(refused, operation.is_change(), "{operation:?} {foreign:?}: {status} {reason}");
            }
        }
        changing += usize::from(operation.is_change());
    }
    assert_eq!(changing, 9);
    let own = format!("http://{}", open.http);
    let (status, ..) = asked(&open, ("DELETE", "/v1/maps/own"), &[("origin", &own)], None).await;
    assert_eq!(status, 204);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_port_of_grpc_takes_calls_alone() {
    let daemon = Daemon::start().await;
    daemon.make_map("own").await;
    let send = async |method: &str, content_type: Option<&str>| {
        let mut request = http::Request::builder().method(method).uri("/mrol.v1.Maps/DeleteMap");
        if let Some(content_type) = content_type {
            request = request.header("content-type", content_type);
        }
        // DeleteMapRequest{map: "own"}, as a page may send it.
        let message = bytes::Bytes::from_static(b"\0\0\0\0\x05\x0a\x03own");
        let body = tonic::body::Body::new(http_body_util::Full::new(message));
        let answer = daemon.channel().await.oneshot(request.body(body).unwrap()).await.unwrap();
        let (parts, body) = answer.into_parts();
        let said = http_body_util::BodyExt::collect(body).await.unwrap().to_bytes();
        (parts.status.as_u16(), parts.headers, String::from_utf8(said.to_vec()).unwrap())
    };
    for content_type in [Some("text/plain"), Some("application/grpc-web+proto"), None] {
        let (status, _, said) = send("POST", content_type).await;
        assert_eq!(status, 415, "{content_type:?}");
        assert!(said.contains("application/grpc"), "{said}");
    }
    for method in ["GET", "PUT", "OPTIONS", "DELETE"] {
        let (status, headers, said) = send(method, Some("application/grpc")).await;
        assert_eq!((status, headers["allow"].to_str().unwrap()), (405, "POST"), "{method}");
        assert!(said.contains("gRPC"), "{said}");
    }
    assert_eq!(daemon.get("/v1/maps/own").await.status(), StatusCode::OK);
    assert_eq!(send("POST", Some("application/grpc")).await.0, 200);
    assert_eq!(daemon.get("/v1/maps/own").await.status(), StatusCode::NOT_FOUND);
}

#[tokio::test(flavor = "multi_thread")]
async fn calls_follow_the_same_rules_and_keep_their_request_id() {
    let daemon = Daemon::start().await;
    let reason = |status: &tonic::Status| {
        status.metadata().get("mrol-reason").map(|reason| reason.to_str().unwrap().to_owned())
    };
    let elsewhere = Channel::from_shared(format!("http://{}", daemon.grpc)).unwrap();
    let elsewhere = elsewhere.origin("http://evil.example:7334".parse().unwrap()).connect().await.unwrap();
    let refused = pb::maps_client::MapsClient::new(elsewhere).list_maps(pb::ListMapsRequest {}).await;
    let refused = refused.unwrap_err();
    assert_eq!(
        (refused.code(), reason(&refused).as_deref()),
        (Code::PermissionDenied, Some("host_not_allowed"))
    );

    let mut delete = Request::new(pb::DeleteMapRequest { map: "own".into() });
    delete.metadata_mut().insert("origin", "https://evil.example".parse().unwrap());
    let refused = daemon.maps().await.delete_map(delete).await.unwrap_err();
    assert_eq!((refused.code(), reason(&refused).as_deref()), (Code::PermissionDenied, Some("cross_site")));

    let mut list = Request::new(pb::ListMapsRequest {});
    list.metadata_mut().insert("x-request-id", "mine-7".parse().unwrap());
    let answer = daemon.maps().await.list_maps(list).await.unwrap();
    assert_eq!(answer.metadata().get("x-request-id").unwrap(), "mine-7");
    let answer = daemon.maps().await.list_maps(pb::ListMapsRequest {}).await.unwrap();
    assert_eq!(answer.metadata().get("x-request-id").unwrap().to_str().unwrap().len(), 36);
}
