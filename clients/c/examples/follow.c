/* Follows a map and asks about a point as it changes; with --once it asks once.
 *
 *     follow http://127.0.0.1:7334 demo 4.6 9.0 1.0 [--once]
 */
#include <mrol.h>
#include <stdio.h>
#include <stdlib.h>

static int failed(const char *what, const mrol_error *error) {
    fprintf(stderr, "%s: %s (%s)\n", what, error->message, mrol_code_name(error->code));
    return 1;
}

static int ask(mrol_replica replica, const float *point) {
    mrol_error error;
    mrol_answer answer;
    uint8_t occupied;
    mrol_point_query query = mrol_point_query_default();
    query.xyz = point;
    query.count = 1;
    if (mrol_replica_query_points(replica, &query, &occupied, sizeof occupied, &answer, &error) != MROL_OK) {
        return failed("query", &error);
    }
    printf("revision %llu: %s\n", (unsigned long long)answer.version.revision, occupied ? "occupied" : "free");
    fflush(stdout);
    return 0;
}

int main(int count, char **words) {
    mrol_error error;
    mrol_replica replica;
    mrol_replica_options options = mrol_replica_options_default();
    float point[3];
    int i, once = count == 7 && strcmp(words[6], "--once") == 0;
    if (count != 6 && !once) {
        fprintf(stderr, "follow ADDRESS MAP X Y Z [--once]\n");
        return 2;
    }
    options.address = words[1];
    options.map = words[2];
    options.key = getenv("MROL_KEY");
    for (i = 0; i < 3; i++) point[i] = (float)atof(words[3 + i]);
    if (mrol_replica_open(&options, &replica, &error) != MROL_OK) return failed("open", &error);
    for (;;) {
        mrol_code code;
        if (ask(replica, point) != 0 || once) break;
        code = mrol_replica_wait_for_revision(replica, mrol_replica_revision(replica) + 1, 60000, &error);
        if (code != MROL_OK && code != MROL_TIMEOUT) {
            failed("wait", &error);
            break;
        }
    }
    mrol_replica_close(replica, NULL);
    return once ? 0 : 1;
}
