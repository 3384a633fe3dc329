//! The adapter behind all services of gRPC, and their routes.

use prost::Message;
use tonic::codec::CompressionEncoding;
use tonic::service::Routes;
use tonic::{Request, Response};
use tonic_health::ServingStatus;
use tonic_health::server::HealthReporter;

use super::decompression::Inflation;
use super::middleware::Grpc;
use super::stubs::mapping_server;
use super::stubs::mapping_server::MappingServer;
use super::stubs::maps_server;
use super::stubs::maps_server::MapsServer;
use super::stubs::occupancy_server;
use super::stubs::occupancy_server::OccupancyServer;
use crate::access::Authorized;
use crate::admission::{Admission, AnswerBytes, InboundBody};
use crate::middleware::Middleware;
use crate::telemetry::RequestRecorder;
use mrol_client::wire::pb;
use mrol_service::{MapService, ServiceError};

/// What every handler has at hand, besides the service that its caller may use.
#[derive(Debug, Clone)]
pub(super) struct Adapter {
    pub(super) admission: Admission,
    pub(super) recorder: RequestRecorder,
    pub(super) inflation: Inflation,
    pub(super) message_bytes_max: usize,
}

/// What the caller of `request` may use. The message counts by its own size from now on: it may have been compressed.
pub(super) fn service_of<T: Message>(request: &Request<T>) -> Result<MapService, ServiceError> {
    InboundBody::of(request.extensions())?.at_least(request.get_ref().encoded_len())?;
    Ok(Authorized::of(request.extensions())?.service.clone())
}

/// An answer, which counts by its size until it is sent.
pub(super) fn answered<T: Message>(answer: T) -> Response<T> {
    let bytes = AnswerBytes(answer.encoded_len());
    let mut response = Response::new(answer);
    response.extensions_mut().insert(bytes);
    response
}

/// The three services, health and reflection. Messages of more than `message_bytes_max` are refused.
///
/// # Errors
/// When the contract that was compiled in cannot be read.
pub fn routes(
    middleware: &Middleware,
    message_bytes_max: usize,
) -> Result<(Routes, Health), tonic_reflection::server::Error> {
    let inflation = Inflation::default();
    let (admission, recorder) = (middleware.admission().clone(), middleware.recorder().clone());
    let adapter = Adapter { admission, recorder, inflation: inflation.clone(), message_bytes_max };
    // Each generated server has the same methods, but no trait names them.
    macro_rules! configured {
        ($server:ident) => {
            $server::new(adapter.clone())
                .max_decoding_message_size(message_bytes_max)
                .max_encoding_message_size(message_bytes_max)
                .accept_compressed(CompressionEncoding::Gzip)
                .accept_compressed(CompressionEncoding::Zstd)
                .send_compressed(CompressionEncoding::Gzip)
                .send_compressed(CompressionEncoding::Zstd)
        };
    }
    let (reporter, health) = tonic_health::server::health_reporter();
    let reflection = tonic_reflection::server::Builder::configure()
        .register_encoded_file_descriptor_set(pb::FILE_DESCRIPTOR_SET)
        .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
        .build_v1()?;
    let services = Routes::new(configured!(OccupancyServer))
        .add_service(configured!(MappingServer))
        .add_service(configured!(MapsServer))
        .add_service(health)
        .add_service(reflection);
    let protocol = Grpc { inflation, message_bytes_max };
    let services = middleware.wrap(protocol, services.into_axum_router());
    Ok((services.into(), Health(reporter)))
}

/// Says by gRPC's health protocol whether the server serves: as a whole (the empty name) and each service.
#[derive(Debug)]
pub struct Health(HealthReporter);

impl Health {
    const SERVICES: [&str; 4] =
        ["", occupancy_server::SERVICE_NAME, mapping_server::SERVICE_NAME, maps_server::SERVICE_NAME];

    /// Says whether it serves.
    pub async fn set(&self, is_serving: bool) {
        let status = if is_serving { ServingStatus::Serving } else { ServingStatus::NotServing };
        for service in Self::SERVICES {
            self.0.set_service_status(service, status).await;
        }
    }
}
