// mrol for C++17: a copy of a map in this process, and calls to the server. One header over mrol.h and its library.
//
//     mrol::client client("http://127.0.0.1:7334");
//     client.create_map("hall", 0.05);
//     mrol::scan_answer put = client.insert("hall", mrol::scan("r1", points));      // std::vector<std::array<float, 3>>, or Eigen
//
//     mrol::replica replica("http://127.0.0.1:7334", "hall");                        // follows the server's map
//     replica.wait_for(put.revision());
//     bool is_free = !replica.query(points)[0];
//     mrol::body ball({{0, 0, 0, 0.3f}});
//     bool can_go = replica.is_free(ball, {mrol::pose(1, 2, 0.5), mrol::pose(1.5, 2, 0.5)});
//
// ERRORS are exceptions: mrol::error, with the code and the stable reason of mrol.h. Who wants codes calls mrol.h, which this
// header includes, with the numbers that handle() returns. Text with a NUL in it is refused by such an error, which names what it
// was given as.
//
// UNITS, THREADS, FORK: as mrol.h says. Objects can be moved and not copied; they close what they opened. Everything that is passed
// in is read during the call alone.
#ifndef MROL_HPP
#define MROL_HPP

#include <mrol.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#if __has_include(<Eigen/Geometry>)
#include <Eigen/Geometry>
#define MROL_HAS_EIGEN 1
#endif

namespace mrol {

// Why a call failed.
class error : public std::runtime_error {
public:
    explicit error(const mrol_error &failed)
        : std::runtime_error(failed.message), code_(failed.code), reason_(failed.reason) {}

    mrol_code code() const noexcept { return code_; }
    // The reason as a word for programs: map_not_found, point_out_of_range, ...; empty where there is none.
    const std::string &reason() const noexcept { return reason_; }

private:
    mrol_code code_;
    std::string reason_;
};

namespace detail {

inline void check(mrol_code code, const mrol_error &failed) {
    if (code != MROL_OK) throw error(failed);
}

// Text without a NUL: mrol.h would take what is before one for all of it, and another map or robot for this one. The text itself
// may be a key, and is not told.
inline const std::string &checked(const std::string &text, const char *field) {
    const std::size_t at = text.find('\0');
    if (at != std::string::npos) {
        mrol_error failed{};
        failed.code = MROL_INVALID_ARGUMENT;
        std::snprintf(failed.message, sizeof failed.message, "%s must be text without a NUL, got one at byte %zu of %zu", field, at,
                      text.size());
        throw error(failed);
    }
    return text;
}
inline const char *c_text(const std::string &text, const char *field) { return checked(text, field).c_str(); }

// A number of the library, which is given back when its owner ends.
template <class Handle, mrol_code (*Close)(Handle, mrol_error *)>
class owned {
public:
    owned() = default;
    owned(owned &&other) noexcept : handle_(std::exchange(other.handle_, Handle{0})) {}
    owned &operator=(owned &&other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    ~owned() {
        if (handle_.number != 0) Close(handle_, nullptr);
    }

    // The number, for calls of mrol.h.
    Handle handle() const noexcept { return handle_; }

protected:
    Handle handle_{0};
};

}  // namespace detail

// A pose, meters and a unit quaternion. One named a_from_b carries points of frame b into frame a.
struct pose {
    std::array<double, 7> numbers{0, 0, 0, 0, 0, 0, 1};

    pose() = default;
    pose(double x, double y, double z, double qx = 0, double qy = 0, double qz = 0, double qw = 1)
        : numbers{x, y, z, qx, qy, qz, qw} {}
    explicit pose(const double (&seven)[7]) {
        for (int i = 0; i < 7; i++) numbers[i] = seven[i];
    }
#ifdef MROL_HAS_EIGEN
    pose(const Eigen::Isometry3d &a_from_b) {
        const Eigen::Quaterniond turn(a_from_b.rotation());
        const Eigen::Vector3d &to = a_from_b.translation();
        numbers = {to.x(), to.y(), to.z(), turn.x(), turn.y(), turn.z(), turn.w()};
    }
    Eigen::Isometry3d isometry() const {
        const Eigen::Quaterniond turn(numbers[6], numbers[3], numbers[4], numbers[5]);
        return Eigen::Translation3d(numbers[0], numbers[1], numbers[2]) * turn.normalized();
    }
#endif
};

namespace detail {
#ifdef MROL_HAS_EIGEN
template <class T>
constexpr bool is_eigen = std::is_base_of_v<Eigen::EigenBase<T>, T>;
#else
template <class T>
constexpr bool is_eigen = false;
#endif

// Whether T has members x, y, z that are floats in this order and nothing else: numbers of another type would be read as the bits
// of floats, which are other places.
template <class T, class = void>
struct has_float_xyz : std::false_type {};
template <class T>
struct has_float_xyz<T, std::void_t<decltype(&T::x), decltype(&T::y), decltype(&T::z)>> {
    static constexpr bool is_in_order() {
        if constexpr (std::is_standard_layout_v<T> && std::is_convertible_v<decltype(&T::x), const float T::*> &&
                      std::is_convertible_v<decltype(&T::y), const float T::*> &&
                      std::is_convertible_v<decltype(&T::z), const float T::*>) {
            return offsetof(T, x) == 0 && offsetof(T, y) == sizeof(float) && offsetof(T, z) == 2 * sizeof(float);
        } else {
            return false;
        }
    }
    static constexpr bool value = is_in_order();
};

// Whether the elements of T, in brackets, are floats: those of arrays and of Eigen's vectors.
template <class T, class = void>
struct has_float_elements : std::false_type {};
template <class T>
struct has_float_elements<T, std::void_t<decltype(std::declval<const T &>()[0])>>
    : std::is_same<decltype(std::declval<const T &>()[0]), const float &> {};

template <class T>
constexpr bool is_three_floats = sizeof(T) == 3 * sizeof(float) && alignof(T) == alignof(float) &&
                                 (std::is_trivially_copyable_v<T> || is_eigen<T>) &&
                                 (has_float_xyz<T>::value || has_float_elements<T>::value);
}  // namespace detail

// Points of somebody else, x y z each, which stay where they are: of a pointer and their number, or of a container whose elements
// are three floats (std::array<float, 3>, Eigen::Vector3f, a struct of another library with floats x, y, z and nothing else), or of
// floats, three for each; or the columns of an Eigen matrix (of blocks and other expressions: their .eval()). What has doubles or
// whole numbers does not compile: it would be read as the bits of floats.
class points {
public:
    points(const float *xyz, std::size_t count) noexcept : xyz_(xyz), count_(count) {}

    template <class Container, class Element = std::remove_pointer_t<decltype(std::declval<const Container &>().data())>,
              class = decltype(std::declval<const Container &>().size()),
              class = std::enable_if_t<!detail::is_eigen<Container>>>
    points(const Container &container) : xyz_(reinterpret_cast<const float *>(container.data())) {
        constexpr bool is_float = std::is_same_v<std::remove_const_t<Element>, float>;
        static_assert(is_float || detail::is_three_floats<std::remove_const_t<Element>>,
                      "points are containers of float, or of elements that are three floats: std::array<float, 3>, "
                      "Eigen::Vector3f, or a struct with float x, y, z; of others, mrol::points(pointer to floats, count)");
        const std::size_t floats = static_cast<std::size_t>(container.size()) * (is_float ? 1 : 3);
        if (floats % 3 != 0) {
            throw std::invalid_argument("points are three floats each, got " + std::to_string(floats) + " floats");
        }
        count_ = floats / 3;
    }
#ifdef MROL_HAS_EIGEN
    template <class Matrix>
    points(const Eigen::PlainObjectBase<Matrix> &columns) noexcept
        : xyz_(columns.data()), count_(static_cast<std::size_t>(columns.cols())) {
        static_assert(std::is_same_v<typename Matrix::Scalar, float> && Matrix::RowsAtCompileTime == 3 && !Matrix::IsRowMajor,
                      "points are the columns of a matrix of floats with three rows");
    }
#endif

    const float *data() const noexcept { return xyz_; }
    std::size_t size() const noexcept { return count_; }

private:
    const float *xyz_ = nullptr;
    std::size_t count_ = 0;
};

// Answers yes or no, one for each that was asked about, at one revision.
class answers {
public:
    answers(std::vector<std::uint8_t> bits, const mrol_answer &answer) : bits_(std::move(bits)), answer_(answer) {}

    bool operator[](std::size_t i) const noexcept { return bits_[i / 8] >> i % 8 & 1; }
    bool at(std::size_t i) const {
        if (i >= size()) throw std::out_of_range("answer " + std::to_string(i) + " of " + std::to_string(size()));
        return (*this)[i];
    }
    std::size_t size() const noexcept { return static_cast<std::size_t>(answer_.asked); }
    // How many are yes.
    std::size_t count() const noexcept { return static_cast<std::size_t>(answer_.positive); }
    const mrol_map_version &version() const noexcept { return answer_.version; }
    std::uint64_t revision() const noexcept { return answer_.version.revision; }

private:
    std::vector<std::uint8_t> bits_;
    mrol_answer answer_;
};

// A ball of a body: its center in the frame of its link, and its radius, meters.
struct sphere {
    float x, y, z, radius;
};

// A robot's body. It is made once, and can be asked about in any replica.
class body : public detail::owned<mrol_body, mrol_body_free> {
public:
    // Of one link.
    body(std::initializer_list<sphere> spheres) { make({std::vector<sphere>(spheres)}); }
    explicit body(const std::vector<sphere> &spheres) { make({spheres}); }
    // Of links, each of which has a pose of its own in a configuration.
    static body of_links(const std::vector<std::vector<sphere>> &links) {
        body made;
        made.make(links);
        return made;
    }

    body(body &&other) noexcept : owned(std::move(other)), links_(std::exchange(other.links_, 0)) {}
    body &operator=(body &&other) noexcept {
        owned::operator=(std::move(other));
        std::swap(links_, other.links_);
        return *this;
    }

    std::size_t links() const noexcept { return links_; }

private:
    body() = default;

    void make(const std::vector<std::vector<sphere>> &links) {
        static_assert(sizeof(sphere) == 4 * sizeof(float), "four floats");
        std::vector<mrol_link> given(links.size());
        for (std::size_t i = 0; i < links.size(); i++) {
            given[i] = mrol_link{};
            given[i].spheres = links[i].empty() ? nullptr : &links[i][0].x;
            given[i].spheres_count = links[i].size();
        }
        mrol_error failed;
        detail::check(mrol_body_new(given.data(), given.size(), &handle_, &failed), failed);
        links_ = links.size();
    }

    std::size_t links_ = 0;
};

// What a question about bodies takes into account.
struct surroundings {
    // 0 is the finest.
    std::uint32_t level = 0;
    bool ignore_keep_outs = false;
    // A voxel counts unless some scan saw through it.
    bool unknown_is_occupied = false;

    // What all questions have of it.
    mrol_scope scope() const noexcept {
        mrol_scope scope{};
        scope.level = level, scope.ignore_keep_outs = ignore_keep_outs;
        return scope;
    }
};

// What a ray meets first.
struct ray_hit {
    bool hit;
    // From the origin; infinite where nothing is hit.
    float distance_m;
};

// Options of a replica: those of mrol.h, which has them all.
using replica_options = mrol_replica_options;

// A copy of a map in this process, which follows the server's; an address may be a list, as mrol.h says of several servers.
class replica : public detail::owned<mrol_replica, mrol_replica_close> {
public:
    replica(const std::string &address, const std::string &map) : replica(options_for(address, map)) {}
    explicit replica(const replica_options &options) {
        mrol_error failed;
        detail::check(mrol_replica_open(&options, &handle_, &failed), failed);
    }

    std::uint64_t revision() const noexcept { return mrol_replica_revision(handle_); }
    mrol_replica_status status() const {
        mrol_error failed;
        mrol_replica_status status;
        detail::check(mrol_replica_get_status(handle_, &status, &failed), failed);
        return status;
    }
    // Refuses a copy whose server was heard longer ago, before a question whose answer must not be older (MROL_STALE).
    void check_age(std::uint64_t age_max_ms) const {
        mrol_error failed;
        detail::check(mrol_replica_check_age(handle_, age_max_ms, &failed), failed);
    }
    // Waits for a revision, that of an answer to an insertion for example.
    void wait_for(std::uint64_t revision, std::uint64_t timeout_ms = 10000) const {
        mrol_error failed;
        detail::check(mrol_replica_wait_for_revision(handle_, revision, timeout_ms, &failed), failed);
    }

    // Which points lie in occupied voxels.
    answers query(const points &asked, std::uint32_t level = 0, bool keep_out = false) const {
        mrol_point_query query = mrol_point_query_default();
        query.xyz = asked.data(), query.count = asked.size(), query.level = level, query.keep_out = keep_out;
        std::vector<std::uint8_t> bits(MROL_BITMAP_BYTES(asked.size()));
        mrol_answer answer;
        mrol_error failed;
        detail::check(mrol_replica_query_points(handle_, &query, bits.data(), bits.size(), &answer, &failed), failed);
        return {std::move(bits), answer};
    }

    // Which configurations collide: poses of all links, configuration by configuration.
    answers collide(const body &of, const std::vector<pose> &configurations, const surroundings &with = {}) const {
        const std::vector<float> numbers = floats_of(configurations);
        mrol_pose_check check = mrol_pose_check_default();
        check.body = of.handle(), check.configurations = numbers.data();
        check.count = count_of(configurations, of);
        check.scope = with.scope();
        check.unknown_is_occupied = with.unknown_is_occupied;
        std::vector<std::uint8_t> bits(MROL_BITMAP_BYTES(check.count));
        mrol_collisions places = mrol_collisions_default();
        places.capacity = check.count, places.colliding = bits.data();
        mrol_answer answer;
        mrol_error failed;
        detail::check(mrol_replica_check_poses(handle_, &check, &places, &answer, &failed), failed);
        return {std::move(bits), answer};
    }

    // Whether a body can move along configurations, two or more: for the innermost loop of a planner.
    bool is_free(const body &of, const std::vector<pose> &way, const surroundings &with = {}) const {
        const std::vector<float> numbers = floats_of(way);
        return is_free(of, numbers.data(), count_of(way, of), with);
    }
    // The same of x y z qx qy qz qw for each link of `count` configurations.
    bool is_free(const body &of, const float *numbers, std::size_t count, const surroundings &with = {}) const {
        mrol_motion_check check = mrol_motion_check_default();
        const std::uint32_t length = static_cast<std::uint32_t>(count);
        std::uint8_t bit = 0;
        check.body = of.handle(), check.configurations = numbers, check.count = count;
        check.lengths = &length, check.motions = 1;
        check.scope = with.scope();
        check.unknown_is_occupied = with.unknown_is_occupied;
        mrol_motion_answers places = mrol_motion_answers_default();
        places.capacity = 1, places.is_free = &bit;
        mrol_error failed;
        detail::check(mrol_replica_check_motions(handle_, &check, &places, nullptr, &failed), failed);
        return bit & 1;
    }

    // What rays meet first: from each origin, or the one origin of all, to each end.
    std::vector<ray_hit> cast(const points &origins, const points &ends, const surroundings &with = {}) const {
        mrol_ray_question question = mrol_ray_question_default();
        question.origins = origins.data(), question.origins_count = origins.size();
        question.ends = ends.data(), question.count = ends.size();
        question.scope = with.scope();
        question.unknown_is_occupied = with.unknown_is_occupied;
        std::vector<std::uint8_t> bits(MROL_BITMAP_BYTES(ends.size()));
        std::vector<float> distances(ends.size());
        mrol_ray_answers places = mrol_ray_answers_default();
        places.capacity = ends.size(), places.hit = bits.data(), places.distances_m = distances.data();
        mrol_error failed;
        detail::check(mrol_replica_cast_rays(handle_, &question, &places, nullptr, &failed), failed);
        std::vector<ray_hit> hits(ends.size());
        for (std::size_t i = 0; i < hits.size(); i++) hits[i] = {(bits[i / 8] >> i % 8 & 1) != 0, distances[i]};
        return hits;
    }

    // The distance to the nearest voxel or keep-out of each point; infinite where there is none within the radius.
    std::vector<float> distances(const points &asked, double radius_m, const surroundings &with = {}) const {
        mrol_nearest_question question = mrol_nearest_question_default();
        question.points = asked.data(), question.count = asked.size(), question.radius_m = radius_m;
        question.scope = with.scope();
        std::vector<float> distances(asked.size());
        mrol_nearest_answers places = mrol_nearest_answers_default();
        places.capacity = asked.size(), places.distances_m = distances.data();
        mrol_error failed;
        detail::check(mrol_replica_find_nearest(handle_, &question, &places, nullptr, &failed), failed);
        return distances;
    }

private:
    static replica_options options_for(const std::string &address, const std::string &map) {
        replica_options options = mrol_replica_options_default();
        options.address = detail::c_text(address, "address"), options.map = detail::c_text(map, "map");
        return options;
    }
    static std::vector<float> floats_of(const std::vector<pose> &poses) {
        std::vector<float> numbers;
        numbers.reserve(7 * poses.size());
        for (const pose &each : poses) {
            for (double number : each.numbers) numbers.push_back(static_cast<float>(number));
        }
        return numbers;
    }
    static std::size_t count_of(const std::vector<pose> &poses, const body &of) {
        if (of.links() == 0 || poses.size() % of.links() != 0) {
            throw std::invalid_argument("configurations are a pose for each of " + std::to_string(of.links()) +
                                        " links, got " + std::to_string(poses.size()) + " poses");
        }
        return poses.size() / of.links();
    }
};

// A scan, as a robot sends it, with points of its own.
class scan {
public:
    scan(std::string robot, const points &in_sensor)
        : robot_(std::move(robot)), xyz_(in_sensor.data(), in_sensor.data() + 3 * in_sensor.size()) {
        detail::checked(robot_, "robot");
    }

    // Where it is thought to have been taken. Without, at the robot's last accepted pose.
    scan &guess(const pose &map_from_sensor) {
        guess_ = map_from_sensor, has_guess_ = true, has_motion_ = false;
        return *this;
    }
    // How far from that pose, as odometry tells.
    scan &motion(const pose &last_from_sensor) {
        motion_ = last_from_sensor, has_motion_ = true, has_guess_ = false;
        return *this;
    }
    // The robot's own number of the scan in this run of its software: sent again under it, it is in the map once.
    scan &id(std::uint64_t number, std::string session = "") {
        detail::checked(session, "session");
        id_ = number, has_id_ = true, session_ = std::move(session);
        return *this;
    }
    // When it was taken, nanoseconds since 1970.
    scan &time(std::int64_t unix_ns) {
        time_ns_ = unix_ns, has_time_ = true;
        return *this;
    }
    // The direction in which things fall, in the sensor frame.
    scan &gravity(double x, double y, double z) {
        gravity_ = {x, y, z}, has_gravity_ = true;
        return *this;
    }
    // It is added at its guess, not aligned.
    scan &at_guess(bool is_so = true) {
        at_guess_ = is_so;
        return *this;
    }
    // It is added where it was found even if it does not fit.
    scan &force(bool is_so = true) {
        force_ = is_so;
        return *this;
    }

    // The struct of mrol.h, which points into this scan.
    mrol_scan c() const noexcept {
        mrol_scan given = mrol_scan_default();
        given.robot = robot_.c_str(), given.session = session_.c_str();
        given.xyz = xyz_.data(), given.count = xyz_.size() / 3;
        given.guess = has_guess_ ? guess_.numbers.data() : nullptr;
        given.motion = has_motion_ ? motion_.numbers.data() : nullptr;
        given.gravity = has_gravity_ ? gravity_.data() : nullptr;
        given.scan_id = id_, given.has_scan_id = has_id_;
        given.timestamp_ns = time_ns_, given.has_timestamp = has_time_;
        given.at_guess = at_guess_, given.force = force_;
        return given;
    }

private:
    std::string robot_, session_;
    std::vector<float> xyz_;
    pose guess_, motion_;
    std::array<double, 3> gravity_{};
    std::uint64_t id_ = 0;
    std::int64_t time_ns_ = 0;
    bool has_guess_ = false, has_motion_ = false, has_gravity_ = false, has_id_ = false, has_time_ = false;
    bool at_guess_ = false, force_ = false;
};

// What became of a scan. One that does not fit is an answer: accepted() is false, and the map is as it was.
class scan_answer {
public:
    explicit scan_answer(const mrol_scan_answer &answer) : answer_(answer) {}

    bool accepted() const noexcept { return answer_.is_accepted != 0; }
    std::string verdict() const { return answer_.verdict; }
    // Why, in a sentence with figures.
    std::string reason() const { return answer_.reason; }
    pose map_from_sensor() const { return pose(answer_.map_from_sensor); }
    double overlap() const noexcept { return answer_.overlap; }
    std::uint64_t new_voxels() const noexcept { return answer_.new_voxels; }
    std::uint64_t revision() const noexcept { return answer_.version.revision; }
    // The struct of mrol.h, which has more.
    const mrol_scan_answer &c() const noexcept { return answer_; }

private:
    mrol_scan_answer answer_;
};

// Where a scan was taken. One that fits nowhere, or in several places, is an answer: accepted() is false.
class localization {
public:
    explicit localization(const mrol_localization_answer &answer) : answer_(answer) {}

    bool accepted() const noexcept { return answer_.is_accepted != 0; }
    std::string reason() const { return answer_.reason; }
    pose map_from_sensor() const { return pose(answer_.map_from_sensor); }
    const mrol_localization_answer &c() const noexcept { return answer_; }

private:
    mrol_localization_answer answer_;
};

// Calls to a server. Threads may share it. An address may be a list of servers of the same maps with commas between them: the
// next is used when one is gone.
class client : public detail::owned<mrol_client, mrol_client_close> {
public:
    explicit client(const std::string &address, const std::string &key = "") : client(options_for(address, key)) {}
    explicit client(const mrol_client_options &options) {
        mrol_error failed;
        detail::check(mrol_client_open(&options, &handle_, &failed), failed);
    }

    // Makes a map, or finds it with these settings.
    void create_map(const std::string &map, double resolution_m, std::uint32_t levels = 0) const {
        mrol_error failed;
        detail::check(mrol_client_create_map(handle_, detail::c_text(map, "map"), resolution_m, levels, &failed), failed);
    }
    // Gives a map another name, which no map has.
    void rename_map(const std::string &map, const std::string &to) const {
        mrol_error failed;
        detail::check(mrol_client_rename_map(handle_, detail::c_text(map, "map"), detail::c_text(to, "to"), &failed), failed);
    }
    // Aligns a scan and, where it fits, adds it: then it is durable.
    scan_answer insert(const std::string &map, const scan &taken) const {
        return scan_call(mrol_client_insert_scan, map, taken);
    }
    // What inserting it would do.
    scan_answer align(const std::string &map, const scan &taken) const {
        return scan_call(mrol_client_align_scan, map, taken);
    }
    // Searches all poses for the one from which a scan was taken. `gravity`: the direction in which things fall in the
    // sensor frame, which makes it ten times as fast.
    localization localize(const std::string &map, const points &in_sensor, const double *gravity = nullptr,
                          std::uint64_t time_limit_ms = 0) const {
        mrol_localization asked = mrol_localization_default();
        asked.xyz = in_sensor.data(), asked.count = in_sensor.size();
        asked.gravity = gravity, asked.time_limit_ms = time_limit_ms;
        mrol_localization_answer answer;
        mrol_error failed;
        detail::check(mrol_client_localize(handle_, detail::c_text(map, "map"), &asked, &answer, &failed), failed);
        return localization(answer);
    }
    // Which points lie in occupied voxels of the server's map.
    answers query(const std::string &map, const points &asked, std::uint32_t level = 0, bool keep_out = false) const {
        mrol_point_query query = mrol_point_query_default();
        query.xyz = asked.data(), query.count = asked.size(), query.level = level, query.keep_out = keep_out;
        std::vector<std::uint8_t> bits(MROL_BITMAP_BYTES(asked.size()));
        mrol_answer answer;
        mrol_error failed;
        detail::check(
            mrol_client_query_points(handle_, detail::c_text(map, "map"), &query, bits.data(), bits.size(), &answer, &failed),
            failed);
        return {std::move(bits), answer};
    }

private:
    template <class Call>
    scan_answer scan_call(Call call, const std::string &map, const scan &taken) const {
        const mrol_scan given = taken.c();
        mrol_scan_answer answer;
        mrol_error failed;
        detail::check(call(handle_, detail::c_text(map, "map"), &given, &answer, &failed), failed);
        return scan_answer(answer);
    }
    static mrol_client_options options_for(const std::string &address, const std::string &key) {
        mrol_client_options options = mrol_client_options_default();
        options.address = detail::c_text(address, "address");
        options.credentials.key = key.empty() ? nullptr : detail::c_text(key, "key");
        return options;
    }
};

}  // namespace mrol

#endif
