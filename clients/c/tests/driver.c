/* Does what it reads, a command a line, and prints a line each: for tests/programs to drive and compare.
 *
 *     open ADDRESS MAP WITH_FILTER [X0 Y0 Z0 X1 Y1 Z1]
 *     query LEVEL LOOKUP KEEP_OUT POSE(7, or -) COUNT X Y Z ...
 *     status | version | wait REVISION TIMEOUT_MS | check_age AGE_MAX_MS | close
 *     open_with_key ADDRESS MAP KEY AGE_MAX_MS
 */
#include "commands.h"
#include <mrol.h>

static mrol_replica replica;

static void hex(const uint8_t *bytes, size_t count) {
    size_t i;
    for (i = 0; i < count; i++) printf("%02x", bytes[i]);
}

static void print_version(const mrol_map_version *version) {
    hex(version->map_uuid, sizeof version->map_uuid);
    printf(" %llu", (unsigned long long)version->revision);
    if (version->has_content_hash) {
        printf(" %016llx", (unsigned long long)version->content_hash);
    } else {
        printf(" -");
    }
}

static int failed(mrol_code code, const mrol_error *error) {
    if (code == MROL_OK) return 0;
    printf("%s %s: %s", mrol_code_name(code), error->reason, error->message);
    return 1;
}

static void open_replica(void) {
    mrol_error error;
    mrol_replica_options options = mrol_replica_options_default();
    char *word;
    int i;
    options.address = strtok(NULL, " ");
    options.map = strtok(NULL, " ");
    options.with_filter = (uint8_t)number();
    word = strtok(NULL, " ");
    if (word != NULL) {
        options.has_region = 1;
        options.region_min_m[0] = strtod(word, NULL);
        for (i = 1; i < 3; i++) options.region_min_m[i] = number();
        for (i = 0; i < 3; i++) options.region_max_m[i] = number();
    }
    if (!failed(mrol_replica_open(&options, &replica, &error), &error)) printf("ok");
}

static void open_with_key(void) {
    mrol_error error;
    mrol_replica_options options = mrol_replica_options_default();
    options.address = strtok(NULL, " ");
    options.map = strtok(NULL, " ");
    options.key = strtok(NULL, " ");
    options.age_max_ms = (uint64_t)number();
    if (!failed(mrol_replica_open(&options, &replica, &error), &error)) printf("ok");
}

static void check_age(void) {
    mrol_error error;
    if (!failed(mrol_replica_check_age(replica, (uint64_t)number(), &error), &error)) printf("ok");
}

static void query_points(void) {
    mrol_error error;
    mrol_answer answer;
    mrol_point_query query = mrol_point_query_default();
    double pose[7];
    char *word;
    float *xyz;
    uint8_t *occupied;
    size_t bytes, i;
    query.level = (uint32_t)number();
    query.lookup = (mrol_lookup)number();
    query.keep_out = (uint8_t)number();
    word = strtok(NULL, " ");
    if (word == NULL) fail_to_read();
    if (strcmp(word, "-") != 0) {
        pose[0] = strtod(word, NULL);
        for (i = 1; i < 7; i++) pose[i] = number();
        query.map_from_points = pose;
    }
    query.count = (size_t)number();
    bytes = MROL_BITMAP_BYTES(query.count);
    occupied = (uint8_t *)memory(bytes);
    query.xyz = xyz = numbers(3 * query.count);
    if (!failed(mrol_replica_query_points(replica, &query, occupied, bytes, &answer, &error), &error)) {
        print_version(&answer.version);
        printf(" %llu %llu ", (unsigned long long)answer.asked, (unsigned long long)answer.positive);
        hex(occupied, bytes);
    }
    free(xyz);
    free(occupied);
}

static void print_status(void) {
    mrol_error error;
    mrol_replica_status status;
    if (failed(mrol_replica_get_status(replica, &status, &error), &error)) return;
    print_version(&status.version);
    printf(" head=%llu resets=%llu connected=%u ended=%u %s %s", (unsigned long long)status.head_revision,
           (unsigned long long)status.resets, (unsigned)status.is_connected, (unsigned)status.has_ended,
           status.age_ms < 60000 ? "young" : "old", status.last_error);
}

static void print_copy(void) {
    mrol_error error;
    mrol_map_version version;
    if (failed(mrol_replica_get_version(replica, &version, &error), &error)) return;
    print_version(&version);
    if (mrol_replica_revision(replica) < version.revision) printf(" and an older revision later");
}

static void wait_for_revision(void) {
    mrol_error error;
    uint64_t revision = (uint64_t)number();
    uint64_t timeout_ms = (uint64_t)number();
    if (!failed(mrol_replica_wait_for_revision(replica, revision, timeout_ms, &error), &error)) printf("ok");
}

static void close_replica(void) {
    mrol_error error;
    if (!failed(mrol_replica_close(replica, &error), &error)) printf("ok");
}

int main(void) {
    static char line[1 << 20];
    while (fgets(line, sizeof line, stdin) != NULL) {
        char *command;
        line[strcspn(line, "\n")] = 0;
        command = strtok(line, " ");
        if (command == NULL) fail_to_read();
        if (strcmp(command, "open") == 0) open_replica();
        else if (strcmp(command, "open_with_key") == 0) open_with_key();
        else if (strcmp(command, "check_age") == 0) check_age();
        else if (strcmp(command, "query") == 0) query_points();
        else if (strcmp(command, "status") == 0) print_status();
        else if (strcmp(command, "version") == 0) print_copy();
        else if (strcmp(command, "wait") == 0) wait_for_revision();
        else if (strcmp(command, "close") == 0) close_replica();
        else fail_to_read();
        printf("\n");
        fflush(stdout);
    }
    return 0;
}
