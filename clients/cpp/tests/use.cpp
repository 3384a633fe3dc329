// Uses all of mrol.hpp: use ADDRESS MAP. Prints "ok", or what is not as it should be; the tests of clients/c run it under the
// address sanitizer.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <mrol.hpp>
#include <thread>

static int failures = 0;

#define EXPECT(what)                                              \
    do {                                                          \
        if (!(what)) {                                            \
            std::printf("line %d: not so: %s\n", __LINE__, #what); \
            failures++;                                           \
        }                                                         \
    } while (0)

// What is thrown by `act`: its reason, or its code where there is none; "nothing" where nothing is.
template <class Act>
static std::string thrown(Act act) {
    try {
        act();
    } catch (const mrol::error &failed) {
        return failed.reason().empty() ? mrol_code_name(failed.code()) : failed.reason();
    } catch (const std::invalid_argument &) {
        return "invalid_argument";
    } catch (const std::out_of_range &) {
        return "out_of_range";
    }
    return "nothing";
}

// A point of another library.
struct xyz {
    float x, y, z;
};

int main(int count, char **words) {
    if (count != 3) return 2;
    const std::string address = words[1], map = words[2];
    mrol::client client(address);
    client.create_map(map, 0.1, 4);
    client.create_map(map, 0.1, 4);
    EXPECT(thrown([&] { client.create_map(map, 0.2, 4); }) == "map_exists");
    EXPECT(thrown([&] { client.create_map("../x", 0.2); }) == "bad_name");
    client.rename_map(map, map + "-1");
    EXPECT(thrown([&] { client.rename_map(map, map + "-3"); }) == "map_not_found");
    client.create_map(map, 0.2, 4);
    EXPECT(thrown([&] { client.rename_map(map + "-1", map); }) == "map_exists");
    EXPECT(thrown([&] { client.rename_map(map, "../x"); }) == "bad_name");
    client.rename_map(map, map + "-4");
    client.rename_map(map + "-1", map);
    EXPECT(thrown([&] { client.create_map(map + "-2", -1); }) == "bad_settings");

    // A wall of 41 x 31 voxels at x = 2, and a floor beside it, seen from the origin.
    std::vector<xyz> wall;
    for (int y = -20; y <= 20; y++) {
        for (int z = -10; z <= 20; z++) wall.push_back({2.05f, 0.1f * y + 0.05f, 0.1f * z + 0.05f});
        for (int x = -20; x < 20; x++) wall.push_back({0.1f * x + 0.05f, 0.1f * y + 0.05f, -0.95f});
        for (int x = -20; x < 20; x++) wall.push_back({0.1f * x + 0.05f, 2.05f, 0.1f * y + 0.05f});
    }
    const mrol::scan_answer first = client.insert(map, mrol::scan("r1", wall).id(1, "run").at_guess());
    EXPECT(first.accepted() && first.new_voxels() > 3000 && first.revision() == 1);
    EXPECT(client.insert(map, mrol::scan("r1", wall).id(1, "run").at_guess()).c().is_replayed == 1);
    EXPECT(thrown([&] { client.insert(map, mrol::scan("r1", wall).id(1, "run").force()); }) == "scan_id_taken");
    EXPECT(thrown([&] { client.insert(map, mrol::scan("r2", wall)); }) == "guess_required");
    EXPECT(thrown([&] { client.insert(map + "-none", mrol::scan("r1", wall)); }) == "map_not_found");
    EXPECT(thrown([&] { client.insert(map, mrol::scan("r 1", wall)); }) == "bad_name");

    // Moved by some centimeters, and found again.
    std::vector<std::array<float, 3>> moved;
    for (const xyz &p : wall) moved.push_back({p.x - 0.07f, p.y + 0.04f, p.z - 0.03f});
    const mrol::scan_answer aligned = client.align(map, mrol::scan("r1", moved).gravity(0, 0, -9.81));
    EXPECT(aligned.accepted());
    EXPECT(std::abs(aligned.map_from_sensor().numbers[0] - 0.07) < 0.03);
    EXPECT(aligned.revision() == 1 && aligned.c().has_information == 1 && !aligned.reason().empty());
    const mrol::scan_answer second =
        client.insert(map, mrol::scan("r1", moved).id(2, "run").motion(mrol::pose(0.05, 0, 0)).time(1700000000000000000));
    EXPECT(second.accepted());
    const double down[3] = {0, 0, -1};
    const mrol::localization found = client.localize(map, moved, down, 5000);
    EXPECT(!found.reason().empty() && found.c().candidates > 0);

    // The server and a copy say the same.
    std::vector<float> asked;
    std::srand(1);
    for (int i = 0; i < 3 * 2000; i++) asked.push_back(static_cast<float>(std::rand() % 600 - 300) / 100);
    for (std::size_t i = 0; i < 200; i++) asked.insert(asked.end(), {wall[i].x, wall[i].y, wall[i].z});
    mrol::replica replica(address, map);
    replica.wait_for(second.revision());
    const mrol::answers here = replica.query(asked), there = client.query(map, asked);
    EXPECT(here.size() == 2200 && here.count() >= 200 && here.count() == there.count());
    EXPECT(here.revision() == there.revision() && here.version().content_hash == there.version().content_hash);
    for (std::size_t i = 0; i < here.size(); i++) EXPECT(here[i] == there[i]);
    EXPECT(thrown([&] { here.at(2200); }) == "out_of_range");
    EXPECT(replica.query(std::vector<xyz>()).size() == 0);
    replica.check_age(600000);
    EXPECT(replica.status().has_ended == 0);
    EXPECT(replica.status().is_connected == 1 && replica.revision() == second.revision());
    EXPECT(replica.query(mrol::points(asked.data(), 3), 1).size() == 3);

    // Bodies, motions, rays, distances.
    const mrol::body ball({{0, 0, 0, 0.3f}});
    const mrol::answers collide = replica.collide(ball, {mrol::pose(0, 0, 0), mrol::pose(1.9, 0, 0)});
    EXPECT(!collide[0] && collide[1] && collide.count() == 1);
    EXPECT(replica.is_free(ball, {mrol::pose(0, 0, 0), mrol::pose(1, 0, 0)}));
    EXPECT(!replica.is_free(ball, {mrol::pose(0, 0, 0), mrol::pose(3, 0, 0)}));
    EXPECT(!replica.is_free(ball, {mrol::pose(0, -3, 0), mrol::pose(1, -3, 0)}, {0, false, true}));
    const mrol::body two = mrol::body::of_links({{{0, 0, 0, 0.1f}}, {{0, 0, 0.5f, 0.1f}}});
    EXPECT(two.links() == 2 && replica.collide(two, {mrol::pose(), mrol::pose(2, 0, 0)})[0]);
    EXPECT(mrol::body(std::vector<mrol::sphere>(3)).links() == 1);
    mrol::body one({{0, 0, 0, 0.1f}}), moved_to = std::move(one);
    EXPECT(moved_to.links() == 1 && one.links() == 0);
    EXPECT(thrown([&] { replica.collide(one, {mrol::pose()}); }) == "invalid_argument");
    one = mrol::body::of_links({{{0, 0, 0, 0.1f}}, {{0, 0, 0.5f, 0.1f}}});
    std::swap(one, moved_to);
    EXPECT(one.links() == 1 && moved_to.links() == 2);
    EXPECT(thrown([&] { replica.collide(two, {mrol::pose()}); }) == "invalid_argument");
    EXPECT(thrown([&] { mrol::body({{0, 0, 0, -1}}); }) == "MROL_INVALID_ARGUMENT");
    EXPECT(thrown([&] { replica.is_free(ball, {mrol::pose()}); }) != "nothing");
    const std::vector<xyz> origin = {{0, 0, 0}}, ends = {{4, 0, 0}, {0, -2, 0}};
    const std::vector<mrol::ray_hit> hits = replica.cast(origin, ends);
    EXPECT(hits[0].hit && std::abs(hits[0].distance_m - 2) < 0.15 && !hits[1].hit && std::isinf(hits[1].distance_m));
    EXPECT(std::abs(replica.distances(origin, 3)[0] - 0.9f) < 0.15f);

    // What makes no question, and what is gone.
    const float nan = std::numeric_limits<float>::quiet_NaN();
    EXPECT(thrown([&] { replica.query(std::vector<xyz>{{nan, 0, 0}}); }) == "point_not_finite");
    EXPECT(thrown([&] { client.query(map, std::vector<xyz>{{nan, 0, 0}}); }) == "point_not_finite");
    EXPECT(thrown([&] { replica.query(std::vector<float>{1, 2}); }) == "invalid_argument");
    EXPECT(thrown([&] { replica.query(asked, 9); }) == "level_out_of_range");
    EXPECT(thrown([&] { mrol::replica(address, map + "-none"); }) == "map_not_found");
    EXPECT(thrown([&] { mrol::client("http://127.0.0.1:9"); }) == "MROL_UNREACHABLE");
    EXPECT(thrown([&] { mrol::client("nonsense://"); }) == "MROL_INVALID_ARGUMENT");
    EXPECT(thrown([&] { mrol::client("http://u:secret@127.0.0.1:9"); }) == "MROL_INVALID_ARGUMENT");
    EXPECT(thrown([&] { mrol::replica("http://127.0.0.1:9/?k=secret", map); }) == "MROL_INVALID_ARGUMENT");
    // Text with a NUL would be another name. Nothing of it is told, since it may be a key.
    const std::string cut = map + std::string("\0secret", 7), robot = std::string("r1\0secret", 9);
    const auto refusal = [](auto act) {
        try {
            act();
        } catch (const mrol::error &failed) {
            return failed.code() == MROL_INVALID_ARGUMENT ? std::string(failed.what()) : "another code";
        }
        return std::string("nothing");
    };
    const auto names = [](const std::string &said, const char *field) {
        return said.find(std::string(field) + " must be text without a NUL, got one at byte ") == 0 &&
               said.find("secret") == std::string::npos;
    };
    EXPECT(names(refusal([&] { client.create_map(cut, 0.1, 4); }), "map"));
    EXPECT(names(refusal([&] { client.insert(cut, mrol::scan("r1", wall)); }), "map"));
    EXPECT(names(refusal([&] { client.align(cut, mrol::scan("r1", wall)); }), "map"));
    EXPECT(names(refusal([&] { client.localize(cut, wall); }), "map"));
    EXPECT(names(refusal([&] { client.query(cut, wall); }), "map"));
    EXPECT(names(refusal([&] { mrol::replica(address, cut); }), "map"));
    EXPECT(names(refusal([&] { mrol::replica(address + robot, map); }), "address"));
    EXPECT(names(refusal([&] { mrol::client(address + robot); }), "address"));
    EXPECT(names(refusal([&] { mrol::client(address, robot); }), "key"));
    EXPECT(names(refusal([&] { mrol::scan(robot, wall); }), "robot"));
    EXPECT(names(refusal([&] { mrol::scan("r1", wall).id(1, robot); }), "session"));
    mrol::replica taken = std::move(replica);
    EXPECT(taken.query(origin).size() == 1);
    EXPECT(thrown([&] { replica.query(origin); }) == "MROL_CLOSED");
    mrol::client other = std::move(client);
    EXPECT(thrown([&] { client.query(map, origin); }) == "MROL_CLOSED");

    // Threads share both.
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; i++) {
        threads.emplace_back([&] {
            for (int n = 0; n < 20; n++) {
                EXPECT(taken.query(asked).count() == here.count());
                EXPECT(other.query(map, asked).count() == here.count());
            }
        });
    }
    for (std::thread &thread : threads) thread.join();
    if (failures == 0) std::printf("ok\n");
    return failures == 0 ? 0 : 1;
}
