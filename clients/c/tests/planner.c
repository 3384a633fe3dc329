/* Asks planners' questions about what it reads, a command a line, and prints a line each: for tests/programs to drive and
 * compare. Numbers of an array begin with how many elements there are; floats are printed as their bits.
 *
 *     open ADDRESS MAP
 *     body LINKS {SPHERES X Y Z R ... POINTS X Y Z ... PADDING} ...
 *     poses|motions KIND LEVEL MAX COUNT NUMBERS ...     KIND: 0 bits, 1 hits, 2 clearances; of the body of the last command
 *     spheres KIND LEVEL MAX COUNT X Y Z R ...
 *     rays LEVEL RANGE COUNT X Y Z DX DY DZ ...
 *     nearest LEVEL TO RADIUS COUNT X Y Z ...
 *     grid LEVEL LOW HIGH
 *     wait REVISION
 *     ignore 0|1                                         keep-outs, in all questions from then on
 */
#include "commands.h"
#include <mrol.h>

static mrol_replica replica;
static mrol_body body;
static size_t links;
static mrol_error error;
static mrol_answer answer;
static uint8_t ignores;

static void print_bits(const uint8_t *bits, size_t count) {
    size_t i;
    printf(" ");
    for (i = 0; i < MROL_BITMAP_BYTES(count); i++) printf("%02x", bits[i]);
}

static void print_words(const void *words, size_t count) {
    size_t i;
    uint32_t word;
    for (i = 0; i < count; i++) {
        memcpy(&word, (const char *)words + 4 * i, 4);
        printf(" %08x", (unsigned)word);
    }
}

static void print_voxels(const uint64_t *voxels, size_t count) {
    size_t i;
    for (i = 0; i < count; i++) printf(" %016llx", (unsigned long long)voxels[i]);
}

static void print_names(const mrol_name *names, size_t count) {
    size_t i;
    for (i = 0; i < count; i++) printf(" %s", names[i].text[0] == 0 ? "-" : names[i].text);
}

static void ignore_keep_outs_or_not(void) {
    ignores = (uint8_t)number();
    printf("ok");
}

/* Prints what all answers have. */
static int answered(mrol_code code) {
    if (code != MROL_OK) {
        printf("%s %s: %s", mrol_code_name(code), error.reason, error.message);
        return 0;
    }
    printf("%llu %llu %llu", (unsigned long long)answer.version.revision, (unsigned long long)answer.asked,
           (unsigned long long)answer.positive);
    return 1;
}

static void open_replica(void) {
    mrol_replica_options options = mrol_replica_options_default();
    options.address = strtok(NULL, " ");
    options.map = strtok(NULL, " ");
    printf("%s", mrol_code_name(mrol_replica_open(&options, &replica, &error)));
}

static void make_body(void) {
    mrol_link parts[16];
    size_t i;
    memset(parts, 0, sizeof parts);
    links = (size_t)number();
    if (links > 16) fail_to_read();
    for (i = 0; i < links; i++) {
        parts[i].spheres_count = (size_t)number();
        parts[i].spheres = numbers(4 * parts[i].spheres_count);
        parts[i].points_count = (size_t)number();
        parts[i].points = numbers(3 * parts[i].points_count);
        parts[i].padding_m = (float)number();
    }
    if (body.number != 0) mrol_body_free(body, NULL);
    printf("%s", mrol_code_name(mrol_body_new(parts, links, &body, &error)));
    for (i = 0; i < links; i++) {
        /* The body has a copy. */
        free((void *)parts[i].spheres);
        free((void *)parts[i].points);
    }
}

/* Places for answers of a kind. */
static mrol_collisions places_of(int kind, size_t count) {
    mrol_collisions places = mrol_collisions_default();
    places.capacity = count;
    places.colliding = (uint8_t *)memory(MROL_BITMAP_BYTES(count));
    if (kind == 1) {
        places.hit_links = (uint32_t *)memory(4 * count);
        places.hit_parts = (uint32_t *)memory(4 * count);
        places.hit_voxels = (uint64_t *)memory(8 * count);
        places.hit_keep_outs = (mrol_name *)memory(count * sizeof(mrol_name));
    } else if (kind == 2) {
        places.clearances_m = (float *)memory(4 * count);
        places.nearest_links = (uint32_t *)memory(4 * count);
    }
    return places;
}

static void print_collisions(mrol_code code, int kind, size_t count, mrol_collisions *places) {
    if (answered(code)) {
        print_bits(places->colliding, count);
        if (kind == 1) {
            print_words(places->hit_links, count);
            print_words(places->hit_parts, count);
            print_voxels(places->hit_voxels, count);
            print_names(places->hit_keep_outs, count);
        } else if (kind == 2) {
            print_words(places->clearances_m, count);
            print_words(places->nearest_links, count);
        }
    }
    free(places->colliding), free(places->hit_links), free(places->hit_parts), free(places->hit_voxels);
    free(places->clearances_m), free(places->nearest_links), free(places->hit_keep_outs);
}

static void check_poses(void) {
    mrol_pose_check check = mrol_pose_check_default();
    mrol_collisions places;
    int kind = (int)number();
    float *read;
    check.body = body;
    check.scope.level = (uint32_t)number();
    check.scope.ignore_keep_outs = ignores;
    check.clearance_max_m = (float)number();
    check.count = (size_t)number();
    check.configurations = read = numbers(7 * links * check.count);
    places = places_of(kind, check.count);
    print_collisions(mrol_replica_check_poses(replica, &check, &places, &answer, &error), kind, check.count, &places);
    free(read);
}

static void check_spheres(void) {
    mrol_sphere_check check = mrol_sphere_check_default();
    mrol_collisions places;
    int kind = (int)number();
    float *read;
    check.scope.level = (uint32_t)number();
    check.scope.ignore_keep_outs = ignores;
    check.clearance_max_m = (float)number();
    check.count = (size_t)number();
    check.spheres = read = numbers(4 * check.count);
    places = places_of(kind, check.count);
    print_collisions(mrol_replica_check_spheres(replica, &check, &places, &answer, &error), kind, check.count, &places);
    free(read);
}

static void check_motions(void) {
    mrol_motion_check check = mrol_motion_check_default();
    mrol_motion_answers places = mrol_motion_answers_default();
    int kind = (int)number();
    size_t motions;
    float *read;
    check.body = body;
    check.scope.level = (uint32_t)number();
    check.scope.ignore_keep_outs = ignores;
    check.clearance_max_m = (float)number();
    check.count = (size_t)number();
    check.configurations = read = numbers(7 * links * check.count);
    places.capacity = motions = check.count / 2;
    places.is_free = (uint8_t *)memory(MROL_BITMAP_BYTES(motions));
    places.first_hits = (float *)memory(4 * motions);
    if (kind == 2) places.clearances_m = (float *)memory(4 * motions);
    if (answered(mrol_replica_check_motions(replica, &check, &places, &answer, &error))) {
        print_bits(places.is_free, motions);
        print_words(places.first_hits, motions);
        if (kind == 2) print_words(places.clearances_m, motions);
    }
    free(read), free(places.is_free), free(places.first_hits), free(places.clearances_m);
}

static void cast_rays(void) {
    mrol_ray_question question = mrol_ray_question_default();
    mrol_ray_answers places = mrol_ray_answers_default();
    float *read, *directions, *origins;
    size_t i, count;
    question.scope.level = (uint32_t)number();
    question.scope.ignore_keep_outs = ignores;
    question.range_m = number();
    count = question.count = question.origins_count = places.capacity = (size_t)number();
    read = numbers(6 * count);
    origins = (float *)memory(12 * count), directions = (float *)memory(12 * count);
    for (i = 0; i < count; i++) {
        memcpy(origins + 3 * i, read + 6 * i, 12);
        memcpy(directions + 3 * i, read + 6 * i + 3, 12);
    }
    question.origins = origins, question.directions = directions;
    places.hit = (uint8_t *)memory(MROL_BITMAP_BYTES(count));
    places.distances_m = (float *)memory(4 * count);
    places.voxels = (uint64_t *)memory(8 * count);
    places.keep_outs = (mrol_name *)memory(count * sizeof(mrol_name));
    if (answered(mrol_replica_cast_rays(replica, &question, &places, &answer, &error))) {
        print_bits(places.hit, count);
        print_words(places.distances_m, count);
        print_voxels(places.voxels, count);
        print_names(places.keep_outs, count);
    }
    free(places.keep_outs), free(read), free(origins), free(directions), free(places.hit), free(places.distances_m), free(places.voxels);
}

static void find_nearest(void) {
    mrol_nearest_question question = mrol_nearest_question_default();
    mrol_nearest_answers places = mrol_nearest_answers_default();
    float *read;
    size_t count;
    question.scope.level = (uint32_t)number();
    question.scope.ignore_keep_outs = ignores;
    question.to = (mrol_measured_to)number();
    question.radius_m = number();
    count = question.count = places.capacity = (size_t)number();
    question.points = read = numbers(3 * count);
    places.found = (uint8_t *)memory(MROL_BITMAP_BYTES(count));
    places.distances_m = (float *)memory(4 * count);
    places.voxels = (uint64_t *)memory(8 * count);
    places.away = (float *)memory(12 * count);
    places.keep_outs = (mrol_name *)memory(count * sizeof(mrol_name));
    if (answered(mrol_replica_find_nearest(replica, &question, &places, &answer, &error))) {
        print_bits(places.found, count);
        print_words(places.distances_m, count);
        print_voxels(places.voxels, count);
        print_words(places.away, 3 * count);
        print_names(places.keep_outs, count);
    }
    free(places.keep_outs), free(read), free(places.found), free(places.distances_m), free(places.voxels), free(places.away);
}

/* Asks for the shape first, and then for as many cells. */
static void project_grid(void) {
    mrol_grid_question question = mrol_grid_question_default();
    mrol_grid_answers places = mrol_grid_answers_default();
    mrol_grid_shape shape;
    size_t cells;
    question.scope.level = (uint32_t)number();
    question.scope.ignore_keep_outs = ignores;
    question.has_min_z = question.has_max_z = 1;
    question.band_from = MROL_BAND_FROM_MAP;
    question.min_z_m = number(), question.max_z_m = number();
    places.shape = &shape;
    if (mrol_replica_project_grid(replica, &question, &places, NULL, &error) != MROL_OK) return;
    cells = places.capacity = (size_t)(shape.cells[0] * shape.cells[1]);
    places.occupied = (uint8_t *)memory(MROL_BITMAP_BYTES(cells));
    places.tops_m = (float *)memory(4 * cells);
    if (answered(mrol_replica_project_grid(replica, &question, &places, &answer, &error))) {
        printf(" %llu %llu %g %g %g", (unsigned long long)shape.cells[0], (unsigned long long)shape.cells[1],
               shape.cell_m, shape.origin_m[0], shape.origin_m[1]);
        print_bits(places.occupied, cells);
        print_words(places.tops_m, cells);
    }
    free(places.occupied), free(places.tops_m);
}

static void wait_for_revision(void) {
    printf("%s", mrol_code_name(mrol_replica_wait_for_revision(replica, (uint64_t)number(), 20000, &error)));
}

int main(void) {
    static char line[1 << 20];
    static const struct {
        const char *name;
        void (*does)(void);
    } commands[] = {{"open", open_replica},     {"body", make_body},       {"poses", check_poses},
                    {"spheres", check_spheres}, {"motions", check_motions}, {"rays", cast_rays},
                    {"nearest", find_nearest},  {"grid", project_grid},    {"wait", wait_for_revision},
                    {"ignore", ignore_keep_outs_or_not}};
    while (fgets(line, sizeof line, stdin) != NULL) {
        char *command;
        size_t i;
        line[strcspn(line, "\n")] = 0;
        command = strtok(line, " ");
        for (i = 0; i < sizeof commands / sizeof *commands; i++) {
            if (command != NULL && strcmp(command, commands[i].name) == 0) break;
        }
        if (i == sizeof commands / sizeof *commands) fail_to_read();
        commands[i].does();
        printf("\n");
        fflush(stdout);
    }
    mrol_body_free(body, NULL);
    mrol_replica_close(replica, NULL);
    return 0;
}
