// Points and poses of Eigen: columns of a matrix or vectors, and isometries.
#include <Eigen/Geometry>
#include <mrol.hpp>

mrol::scan_answer put(const mrol::client &client, const Eigen::Matrix3Xf &in_sensor, const Eigen::Isometry3d &guess) {
    return client.insert("hall", mrol::scan("r1", in_sensor).guess(guess));
}

bool is_free(const mrol::replica &replica, const mrol::body &body, const Eigen::Isometry3d &from, const Eigen::Isometry3d &to) {
    return replica.is_free(body, {from, to});
}

Eigen::Isometry3d where(const mrol::scan_answer &answer) { return answer.map_from_sensor().isometry(); }

mrol::answers occupied(const mrol::replica &replica, const std::vector<Eigen::Vector3f> &points) { return replica.query(points); }
