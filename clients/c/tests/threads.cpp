// Threads that ask one replica while it is closed, and replicas that are opened and closed beside each other.
//
//     threads ADDRESS MAP      of a map of 0.1 m with three occupied voxels about (0.05 .. 0.25, 0.05, 0.05)

#include <mrol.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

struct Failed : std::runtime_error {
    Failed(mrol_code code, const mrol_error &error) : runtime_error(error.message), code(code) {}
    mrol_code code;
};

void must(bool condition, const char *what) {
    if (!condition) {
        std::fprintf(stderr, "it is not so: %s\n", what);
        std::exit(1);
    }
}

enum class Moves { freely, no_body };

// How a C++ program may wrap it.
class Replica {
public:
    Replica(const char *address, const char *map) {
        auto options = mrol_replica_options_default();
        options.address = address;
        options.map = map;
        options.with_filter = 1;
        call([&](mrol_error *error) { return mrol_replica_open(&options, &replica_, error); });
    }
    Replica(const Replica &) = delete;
    Replica &operator=(const Replica &) = delete;
    ~Replica() { close(); }

    // What other threads ask meanwhile is answered, or fails with MROL_CLOSED.
    void close() { mrol_replica_close(replica_, nullptr); }

    mrol_answer occupied(const std::vector<std::array<float, 3>> &points, std::vector<std::uint8_t> &bits) const {
        auto query = mrol_point_query_default();
        query.xyz = points.data()->data();
        query.count = points.size();
        query.lookup = MROL_LOOKUP_BLOOM;
        bits.resize(MROL_BITMAP_BYTES(points.size()));
        mrol_answer answer;
        call([&](mrol_error *error) {
            return mrol_replica_query_points(replica_, &query, bits.data(), bits.size(), &answer, error);
        });
        return answer;
    }

    // From 0.5 m beside the row of voxels along it, and into it.
    Moves moves_freely(mrol_body body) const {
        static constexpr std::array<float, 28> motions{0, 0.5f, 0.05f, 0, 0, 0, 1, 0.3f, 0.5f,  0.05f, 0, 0, 0, 1,
                                                       0, 0.5f, 0.05f, 0, 0, 0, 1, 0,    0.05f, 0.05f, 0, 0, 0, 1};
        auto check = mrol_motion_check_default();
        check.body = body;
        check.configurations = motions.data();
        check.count = 4;
        std::uint8_t is_free = 0;
        auto places = mrol_motion_answers_default();
        places.capacity = 2;
        places.is_free = &is_free;
        mrol_error error;
        const auto code = mrol_replica_check_motions(replica_, &check, &places, nullptr, &error);
        if (code == MROL_INVALID_ARGUMENT) return Moves::no_body;
        if (code != MROL_OK) throw Failed(code, error);
        must(is_free == 1, "the first motion is free, and the second is not");
        return Moves::freely;
    }

    void wait_for(std::uint64_t revision, std::chrono::milliseconds timeout) const {
        const auto milliseconds = static_cast<std::uint64_t>(timeout.count());
        call([&](mrol_error *error) {
            return mrol_replica_wait_for_revision(replica_, revision, milliseconds, error);
        });
    }

private:
    template <typename Call> static void call(Call call) {
        mrol_error error;
        if (const auto code = call(&error); code != MROL_OK) throw Failed(code, error);
    }

    mrol_replica replica_{};
};

// A body that threads ask about, one of them frees, and nobody else gets the number of.
void share_a_body(const char *address, const char *map) {
    const Replica replica(address, map);
    const std::array<float, 4> sphere{0.0f, 0.0f, 0.0f, 0.1f};
    mrol_link link{};
    link.spheres = sphere.data();
    link.spheres_count = 1;
    mrol_body body;
    must(mrol_body_new(&link, 1, &body, nullptr) == MROL_OK, "there is a body");
    std::atomic<int> answered{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; i++) {
        threads.emplace_back([&] {
            must(replica.moves_freely(body) == Moves::freely, "a body that nobody freed is known");
            answered++;
            while (replica.moves_freely(body) != Moves::no_body) {
            }
        });
    }
    while (answered < 4) std::this_thread::yield();
    must(mrol_body_free(body, nullptr) == MROL_OK, "the body is freed once");
    for (auto &thread : threads) thread.join();
}

// Asks until the replica is closed; how often it was answered.
std::size_t ask(const Replica &replica, const std::vector<std::array<float, 3>> &points, std::atomic<int> &started) {
    std::vector<std::uint8_t> bits;
    for (std::size_t answers = 0;; answers++) {
        try {
            const auto answer = replica.occupied(points, bits);
            must(answer.asked == points.size() && answer.version.revision == 1, "the answer is about the points");
            must((bits[0] & 7) == 7, "three points are occupied");
            if (answers == 0) started++;
        } catch (const Failed &failed) {
            must(failed.code == MROL_CLOSED, failed.what());
            return answers;
        }
    }
}

void close_while_threads_ask(const char *address, const char *map) {
    std::vector<std::array<float, 3>> points(1000, {9.0f, 9.0f, 9.0f});
    for (std::size_t i = 0; i < 3; i++) points[i] = {0.05f + 0.1f * static_cast<float>(i), 0.05f, 0.05f};
    Replica replica(address, map);
    std::atomic<int> started{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; i++) {
        threads.emplace_back([&] { must(ask(replica, points, started) > 0, "every thread was answered"); });
    }
    threads.emplace_back([&] {
        try {
            started++;
            replica.wait_for(1000, std::chrono::minutes(10));
            must(false, "the wait fails");
        } catch (const Failed &failed) {
            must(failed.code == MROL_CLOSED, failed.what());
        }
    });
    while (started < 5) std::this_thread::yield();
    replica.close();
    for (auto &thread : threads) thread.join();
}

void open_beside_each_other(const char *address, const char *map) {
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; i++) {
        threads.emplace_back([=] {
            for (int round = 0; round < 5; round++) {
                const Replica replica(address, map);
                replica.wait_for(1, std::chrono::seconds(1));
            }
        });
    }
    for (auto &thread : threads) thread.join();
}

}  // namespace

int main(int count, char **words) {
    must(count == 3, "there is an address and a map");
    close_while_threads_ask(words[1], words[2]);
    open_beside_each_other(words[1], words[2]);
    share_a_body(words[1], words[2]);
    std::puts("ok");
}
