// A robot maps a room, and a planner beside it follows the map: robot ADDRESS MAP, http://127.0.0.1:7334 and any name for example.
#include <cmath>
#include <cstdio>
#include <mrol.hpp>
#include <random>

// How far from `from` a ray enters the box (or leaves it, from inside): infinity where it misses.
static float reach(const float from[3], const float way[3], const float low[3], const float high[3]) {
    float enters = -INFINITY, leaves = INFINITY;
    for (int axis = 0; axis < 3; axis++) {
        const float one = (low[axis] - from[axis]) / way[axis], other = (high[axis] - from[axis]) / way[axis];
        enters = std::fmax(enters, std::fmin(one, other)), leaves = std::fmin(leaves, std::fmax(one, other));
    }
    if (enters > leaves || leaves < 0) return INFINITY;
    return enters > 0 ? enters : leaves;
}

// What a sensor at (x, y, 1.5) sees of a room of 8 x 6 x 3 m with a post, in its own frame.
static std::vector<std::array<float, 3>> look(float x, float y) {
    static std::mt19937 random(1);
    std::normal_distribution<float> normal;
    const float from[3] = {x, y, 1.5f};
    const float room[2][3] = {{0, 0, 0}, {8, 6, 3}}, post[2][3] = {{5.05f, 2, 0}, {5.45f, 2.6f, 3}};
    std::vector<std::array<float, 3>> points;
    for (int i = 0; i < 40000; i++) {
        const float way[3] = {normal(random), normal(random), normal(random)};
        const float far = std::fmin(reach(from, way, room[0], room[1]), reach(from, way, post[0], post[1]));
        points.push_back({far * way[0], far * way[1], far * way[2]});
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
        // Its wheels say how far it went. Without that a pose on the other side of so plain a room may be as likely.
        const mrol::scan second = mrol::scan("r1", look(2.4f, 3.1f)).id(2, "run-1").motion(mrol::pose(0.4, 0.1, 0));
        const mrol::scan_answer put = client.insert(words[2], second);
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
