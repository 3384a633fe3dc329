/* Passes every kind of damaged argument; each is a code and a message, and nothing else happens.
 *
 *     hostile ADDRESS MAP      of a map of 0.1 m with three occupied voxels about (0.05 .. 0.25, 0.05, 0.05)
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <mrol.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#define MUST(condition)                                                     \
    do {                                                                    \
        if (!(condition)) {                                                 \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
            exit(1);                                                        \
        }                                                                   \
    } while (0)

static const mrol_replica NONE = {0};

/* The call fails with the code, and its message has the words. */
#define FAILS(call, expected, words)                                            \
    do {                                                                        \
        mrol_error error;                                                       \
        memset(&error, 0x55, sizeof error);                                     \
        MUST((call) == (expected));                                             \
        MUST(error.code == (expected) && error.reserved == 0);                  \
        MUST(memchr(error.reason, 0, sizeof error.reason) != NULL);             \
        MUST(memchr(error.message, 0, sizeof error.message) != NULL);           \
        if (strstr(error.message, (words)) == NULL) {                           \
            fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, error.message);  \
            exit(1);                                                            \
        }                                                                       \
    } while (0)

static void *misaligned(void *pointer) {
    return (char *)pointer + 1;
}

static mrol_replica_options options_for(const char *address, const char *map) {
    mrol_replica_options options = mrol_replica_options_default();
    options.address = address;
    options.map = map;
    return options;
}

static void bad_options(const char *address, const char *map) {
    mrol_replica replica = {99};
    mrol_replica_options good = options_for(address, map), options;
    char *far_too_long = (char *)malloc(5001);
    struct {
        mrol_replica_options known;
        uint64_t unknown;
    } newer;
    MUST(far_too_long != NULL);
    memset(far_too_long, 'a', 5000);
    far_too_long[5000] = 0;
#define OPENING_FAILS(code, words) FAILS(mrol_replica_open(&options, &replica, &error), code, words)
    FAILS(mrol_replica_open(NULL, &replica, &error), MROL_INVALID_ARGUMENT, "options is NULL");
    MUST(replica.number == 0);
    FAILS(mrol_replica_open(&good, NULL, &error), MROL_INVALID_ARGUMENT, "replica is NULL");
    FAILS(mrol_replica_open(misaligned(&good), &replica, &error), MROL_INVALID_ARGUMENT, "options is at address");
    options = good, options.struct_size = 0;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "struct_size must lie in");
    options = good, options.struct_size = SIZE_MAX;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "struct_size must lie in");
    newer.known = good, newer.known.struct_size = sizeof newer, newer.unknown = 1;
    FAILS(mrol_replica_open(&newer.known, &replica, &error), MROL_INVALID_ARGUMENT, "too old");
    options = good, options.address = NULL;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.address is NULL");
    options = good, options.address = "nothing like it";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "is no server address");
    options = good, options.address = far_too_long;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.address has more than 4096 bytes");
    options = good, options.map = NULL;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.map is NULL");
    options = good, options.map = "";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "");
    options = good, options.map = "\xff\xfe";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.map is not UTF-8");
    options = good, options.key = "two words";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "the key must be");
    options = good, options.ca_file = "/nowhere/ca.pem";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.ca_file: /nowhere/ca.pem cannot be read");
    options = good, options.ca_file = "/dev/null";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "must be PEM");
    options = good, options.certificate_file = "/dev/null";
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "one of certificate_file and private_key_file");
    options = good, options.has_region = 2;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.has_region must be 0 or 1, got 2");
    options = good, options.with_filter = 255;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.with_filter must be 0 or 1, got 255");
    options = good, options.reserved[5] = 1;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "options.reserved must be zero");
    options = good, options.has_region = 1, options.region_min_m[1] = 1.0;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "");
    options = good, options.has_region = 1, options.region_min_m[1] = NAN;
    OPENING_FAILS(MROL_INVALID_ARGUMENT, "");
    options = good, options.blocks_max = 1, options.has_region = 0;
    MUST(mrol_replica_open(&options, &replica, NULL) == MROL_OK);
    MUST(mrol_replica_close(replica, NULL) == MROL_OK);
    options = options_for(address, "no_such_map");
    OPENING_FAILS(MROL_REFUSED, "no_such_map");
    options = options_for("http://127.0.0.1:1", map);
    OPENING_FAILS(MROL_UNREACHABLE, "http://127.0.0.1:1");
    MUST(mrol_replica_open(&options, &replica, NULL) == MROL_UNREACHABLE && replica.number == 0);
    /* The error itself. */
    MUST(mrol_replica_open(&good, &replica, misaligned(&options)) == MROL_INVALID_ARGUMENT);
    free(far_too_long);
}

static void bad_queries(mrol_replica replica) {
    float xyz[9] = {0.05f, 0.05f, 0.05f, 0.15f, 0.05f, 0.05f, 5.0f, 5.0f, 5.0f};
    double pose[7] = {0, 0, 0, 0, 0, 0, 1};
    uint8_t occupied[2] = {0xaa, 0xaa};
    mrol_answer answer;
    mrol_point_query good = mrol_point_query_default(), query;
    good.xyz = xyz, good.count = 3, good.map_from_points = pose;
#define QUERY(question, to, bytes) mrol_replica_query_points(replica, question, to, bytes, &answer, &error)
#define QUERY_FAILS(words) FAILS(QUERY(&query, occupied, sizeof occupied), MROL_INVALID_ARGUMENT, words)
    memset(&answer, 0x55, sizeof answer);
    FAILS(QUERY(NULL, occupied, 1), MROL_INVALID_ARGUMENT, "query is NULL");
    FAILS(QUERY(misaligned(&good), occupied, 1), MROL_INVALID_ARGUMENT, "query is at address");
    FAILS(QUERY(&good, NULL, 1), MROL_INVALID_ARGUMENT, "occupied is NULL");
    FAILS(QUERY(&good, occupied, 0), MROL_INVALID_ARGUMENT, "occupied_bytes must be at least 1");
    FAILS(QUERY(&good, (uint8_t *)xyz + 35, 1), MROL_INVALID_ARGUMENT, "occupied overlaps");
    query = good, query.struct_size = 1;
    QUERY_FAILS("query.struct_size");
    query = good, query.xyz = NULL;
    QUERY_FAILS("query.xyz is NULL");
    query = good, query.xyz = misaligned(xyz);
    QUERY_FAILS("query.xyz is at address");
    query = good, query.map_from_points = misaligned(pose);
    QUERY_FAILS("query.map_from_points is at address");
    query = good, query.count = MROL_POINTS_MAX + 1;
    FAILS(QUERY(&query, occupied, SIZE_MAX), MROL_INVALID_ARGUMENT, "query.count must be at most 134217728");
    query = good, query.count = SIZE_MAX;
    FAILS(QUERY(&query, occupied, SIZE_MAX), MROL_INVALID_ARGUMENT, "query.count must be at most 134217728");
    query = good, query.level = 4;
    QUERY_FAILS("level must lie in 0..=3, got 4");
    query = good, query.level = UINT32_MAX;
    QUERY_FAILS("level must lie in");
    query = good, query.lookup = 2;
    QUERY_FAILS("query.lookup must be 0 or 1, got 2");
    query = good, query.lookup = -1;
    QUERY_FAILS("query.lookup must be 0 or 1, got -1");
    pose[6] = 2.0;
    query = good;
    QUERY_FAILS("unit quaternion");
    pose[6] = 1.0, pose[1] = NAN;
    QUERY_FAILS("translation_m must be finite");
    pose[1] = 0.0, xyz[4] = INFINITY;
    QUERY_FAILS("points[1]");
    xyz[4] = 1e30f;
    QUERY_FAILS("points[1]");
    xyz[4] = 0.05f;
    MUST(mrol_replica_query_points(replica, &good, occupied, 1, misaligned(&answer), NULL) == MROL_INVALID_ARGUMENT);
    MUST(occupied[0] == 0xaa && answer.asked == 0x5555555555555555u);
    /* And what is right, with and without what may be NULL. */
    MUST(mrol_replica_query_points(replica, &good, occupied, 1, NULL, NULL) == MROL_OK);
    MUST(occupied[0] == 0x03 && occupied[1] == 0xaa);
    good.map_from_points = NULL, good.count = 0, good.xyz = NULL;
    MUST(mrol_replica_query_points(replica, &good, NULL, 0, &answer, NULL) == MROL_OK);
    MUST(answer.asked == 0 && answer.positive == 0 && answer.version.revision == 1 && answer.reserved[3] == 0);
}

static void bad_replicas(mrol_replica replica) {
    mrol_replica_status status;
    mrol_map_version version;
    mrol_replica others[3];
    mrol_point_query query = mrol_point_query_default();
    size_t i;
    others[0] = NONE, others[1].number = replica.number + 1, others[2].number = UINT64_MAX;
    for (i = 0; i < 3; i++) {
        mrol_replica other = others[i];
        FAILS(mrol_replica_get_status(other, &status, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_get_version(other, &version, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_wait_for_revision(other, 0, 0, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_query_points(other, &query, NULL, 0, NULL, &error), MROL_CLOSED, "not open");
        FAILS(mrol_replica_close(other, &error), MROL_CLOSED, "not open");
        MUST(mrol_replica_revision(other) == 0);
    }
    FAILS(mrol_replica_get_status(replica, NULL, &error), MROL_INVALID_ARGUMENT, "status is NULL");
    FAILS(mrol_replica_get_version(replica, misaligned(&version), &error), MROL_INVALID_ARGUMENT, "version is at");
    FAILS(mrol_replica_wait_for_revision(replica, 2, 1, &error), MROL_TIMEOUT, "revision 2 did not come");
    MUST(mrol_replica_wait_for_revision(replica, 1, UINT64_MAX, NULL) == MROL_OK);
}

/* In a child nothing hangs, and nothing is answered. */
static void a_child_is_refused(const mrol_replica_options *options, mrol_replica replica) {
    int status = 0;
    pid_t child = fork();
    MUST(child >= 0);
    if (child == 0) {
        mrol_replica own;
        mrol_point_query query = mrol_point_query_default();
        FAILS(mrol_replica_query_points(replica, &query, NULL, 0, NULL, &error), MROL_FORKED, "forked");
        FAILS(mrol_replica_wait_for_revision(replica, 9, 9, &error), MROL_FORKED, "forked");
        FAILS(mrol_replica_open(options, &own, &error), MROL_FORKED, "forked");
        FAILS(mrol_replica_close(replica, &error), MROL_FORKED, "forked");
        _exit(0);
    }
    MUST(waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

int main(int count, char **words) {
    mrol_replica replica;
    mrol_replica_options options;
    MUST(count == 3);
    MUST(mrol_abi_version() == MROL_ABI_VERSION && mrol_library_version()[0] != 0);
    MUST(strcmp(mrol_code_name(MROL_TIMEOUT), "MROL_TIMEOUT") == 0);
    MUST(strcmp(mrol_code_name(-7), "MROL_UNKNOWN") == 0);
    bad_options(words[1], words[2]);
    options = options_for(words[1], words[2]);
    MUST(mrol_replica_open(&options, &replica, NULL) == MROL_OK);
    bad_queries(replica);
    bad_replicas(replica);
    a_child_is_refused(&options, replica);
    MUST(mrol_replica_revision(replica) == 1);
    MUST(mrol_replica_close(replica, NULL) == MROL_OK);
    MUST(mrol_replica_close(replica, NULL) == MROL_CLOSED);
    printf("ok\n");
    return 0;
}
