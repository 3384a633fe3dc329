// A robot maps a room, and a planner beside it follows the map: robot ADDRESS MAP, http://127.0.0.1:7334 and any name for example.
#include <cmath>
#include <cstdio>
#include <mrol.hpp>
#include <random>

// What a sensor at (x, y, 1.5) sees of a room of 8 x 6 x 3 m with a post, in its own frame.
static std::vector<std::array<float, 3>> look(float x, float y) {
    static std::mt19937 random(1);
    std::uniform_real_distribution<float> share(0, 1);
    std::vector<std::array<float, 3>> points;
    for (int i = 0; i < 40000; i++) {
        std::array<float, 3> at = {8 * share(random), 6 * share(random), 3 * share(random)};
        const float sides[3] = {8, 6, 3};
        const int axis = i % 3;
        at[axis] = share(random) < 0.5f ? 0 : sides[axis];
        if (i % 8 == 0) at = {5.05f, 2 + 0.6f * share(random), 3 * share(random)};
        points.push_back({at[0] - x, at[1] - y, at[2] - 1.5f});
    }
    return points;
}

int main(int count, char **words) {
    if (count != 3) {
        std::fprintf(stderr, "robot ADDRESS MAP\n");
        return 2;
    }
    try {
        const mrol::client client(words[1]);
        client.create_map(words[2], 0.1);
        client.insert(words[2], mrol::scan("r1", look(2, 3)).id(1, "run-1").guess(mrol::pose(2, 3, 1.5)).at_guess());
        mrol::scan_answer put = client.insert(words[2], mrol::scan("r1", look(2.4f, 3.1f)).id(2, "run-1"));
        const mrol::pose found = put.map_from_sensor();
        std::printf("%s at %.2f %.2f %.2f: %s\n", put.accepted() ? "accepted" : "refused", found.numbers[0],
                    found.numbers[1], found.numbers[2], put.reason().c_str());

        const mrol::replica replica(words[1], words[2]);
        replica.wait_for(put.revision());
        const mrol::body drone({{0, 0, 0, 0.25f}});
        const bool through = replica.is_free(drone, {mrol::pose(4, 2.3, 1), mrol::pose(6, 2.3, 1)});
        const bool around = replica.is_free(drone, {mrol::pose(4, 2.3, 1), mrol::pose(4, 4, 1)});
        std::printf("through the post: %s, around it: %s\n", through ? "free" : "blocked", around ? "free" : "blocked");
        return put.accepted() && !through && around ? 0 : 1;
    } catch (const mrol::error &failed) {
        std::fprintf(stderr, "%s (%s, %s)\n", failed.what(), mrol_code_name(failed.code()), failed.reason().c_str());
        return 1;
    }
}
