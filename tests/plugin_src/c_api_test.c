/* The C interface from plain C: what a host would do, and what a clumsy one would. Argument: a folder to bake into. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plugin_src/c_api/sunder.h"

static int failures = 0;

#define CHECK(condition)                                                      \
    do {                                                                      \
        if (!(condition)) {                                                   \
            fprintf(stderr, "line %d: not true: %s\n", __LINE__, #condition); \
            ++failures;                                                       \
        }                                                                     \
    } while (0)

static const char* const scene =
    "{\"sunder\": 1, \"frame_range\": [1, 4], \"nodes\": {"
    "\"bar\": {\"type\": \"lattice\", \"cells\": [2, 2, 4], \"size\": [0.2, 0.2, 0.4]},"
    "\"clay\": {\"type\": \"body\", \"fragments\": \"@bar.fragments\"},"
    "\"sim\": {\"type\": \"solver\", \"bodies\": [\"@clay.body\"]},"
    "\"cache\": {\"type\": \"bake_state\", \"state\": \"@sim.state\"}}}";

static sunder_error error_of(const sunder_graph* graph) {
    sunder_error e;
    memset(&e, 0, sizeof e);
    e.struct_size = sizeof e;
    sunder_graph_error(graph, &e);
    return e;
}

struct watch {
    int calls, stop_after;
};

static int32_t on_progress(void* user, double fraction, const char* text) {
    struct watch* w = user;
    CHECK(fraction >= 0 && fraction <= 1 && text != NULL);
    return ++w->calls <= w->stop_after;
}

static void edits_and_errors(sunder_graph* graph) {
    const char* json = NULL;
    CHECK(sunder_graph_add_node(graph, "floor", "collider") == SUNDER_OK);
    CHECK(sunder_graph_set(graph, "floor", "friction", "0.25") == SUNDER_OK);
    CHECK(sunder_graph_get(graph, "floor", "friction", &json) == SUNDER_OK && strcmp(json, "0.25") == 0);
    CHECK(sunder_graph_connect(graph, "floor.collider", "sim.colliders") == SUNDER_OK);
    CHECK(sunder_graph_get(graph, "sim", "colliders", &json) == SUNDER_OK &&
          strcmp(json, "[\"@floor.collider\"]") == 0);
    CHECK(sunder_graph_disconnect(graph, "sim.colliders") == SUNDER_OK);
    CHECK(sunder_graph_reset(graph, "floor", "friction") == SUNDER_OK);
    CHECK(sunder_graph_set(graph, "clay", "toughness", "{\"keys\": [[1, 1.0], [3, 2.0]]}") == SUNDER_OK);
    CHECK(sunder_graph_get_at(graph, "clay", "toughness", 2, &json) == SUNDER_OK && strcmp(json, "1.5") == 0);
    CHECK(sunder_graph_reset(graph, "clay", "toughness") == SUNDER_OK);

    CHECK(sunder_graph_set(graph, "clay", "density", "-3") == SUNDER_BAD_INPUT);
    CHECK(strcmp(error_of(graph).node, "clay") == 0 && strcmp(error_of(graph).parameter, "density") == 0);
    CHECK(strlen(error_of(graph).what) > 0 && strstr(error_of(graph).text, error_of(graph).what) != NULL);
    CHECK(sunder_graph_set(graph, "clay", "density", "{") == SUNDER_BAD_INPUT);
    CHECK(strcmp(error_of(graph).node, "clay") == 0 && strcmp(error_of(graph).parameter, "density") == 0);
    CHECK(sunder_graph_set(graph, "clay", "denisty", "1") == SUNDER_BAD_INPUT);
    CHECK(sunder_graph_connect(graph, "bar.fragments", "sim.bodies") == SUNDER_BAD_INPUT);
    CHECK(sunder_graph_connect(graph, "no dot", "sim.bodies") == SUNDER_BAD_INPUT);
    CHECK(sunder_graph_parse(graph, "{\"sunder\": 1", "here", "") == SUNDER_BAD_INPUT);
    CHECK(sunder_graph_set_frame_range(graph, 4, 1) == SUNDER_BAD_INPUT);
    CHECK(sunder_graph_remove_node(graph, "floor") == SUNDER_OK);
    CHECK(error_of(graph).status == SUNDER_OK && strcmp(error_of(graph).text, "") == 0);

    /* A clumsy host: NULL where something must be, and structs whose size was forgotten. */
    CHECK(sunder_graph_set(graph, NULL, "a", "1") == SUNDER_BAD_USAGE);
    CHECK(sunder_graph_json(graph, 0, NULL) == SUNDER_BAD_USAGE);
    CHECK(sunder_graph_load(NULL, "a") == SUNDER_BAD_USAGE);
    CHECK(sunder_graph_evaluate(graph, "sim.state", 1, NULL, NULL) == SUNDER_BAD_USAGE);
    CHECK(sunder_graph_bake(graph, NULL, NULL, NULL) == SUNDER_BAD_USAGE);
    sunder_graph_error(NULL, NULL);
    sunder_graph_free(NULL);
    sunder_value_free(NULL);
    sunder_graph_cancel(NULL);
}

static void values(sunder_graph* graph) {
    sunder_value *value = NULL, *fragments = NULL, *piece = NULL;
    struct watch w = {0, 1000000};
    sunder_progress progress = {sizeof(sunder_progress), on_progress, &w};
    CHECK(sunder_graph_evaluate(graph, "sim.state", 3, &progress, &value) == SUNDER_OK);
    CHECK(w.calls > 0);
    if (!value) return;
    CHECK(strcmp(sunder_value_type(value), "state") == 0);
    CHECK(sunder_value_array_count(value) > 10);
    CHECK(sunder_value_array_name(value, 100000) == NULL);

    sunder_array a;
    memset(&a, 0, sizeof a);
    CHECK(sunder_value_array(value, "position", &a) == SUNDER_BAD_USAGE); /* struct_size is not set */
    for (uint32_t i = 0; i < sunder_value_array_count(value); ++i) {
        a.struct_size = sizeof a;
        CHECK(sunder_value_array(value, sunder_value_array_name(value, i), &a) == SUNDER_OK);
        CHECK(a.rank >= 1 && a.rank <= 4 && (a.data != NULL || a.shape[0] == 0));
    }
    a.struct_size = sizeof a;
    CHECK(sunder_value_array(value, "orientation", &a) == SUNDER_OK);
    CHECK(a.type == SUNDER_FLOAT64 && a.rank == 2 && a.shape[0] == 16 && a.shape[1] == 4);
    const double* q = a.data;
    CHECK(fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1) < 1e-9);
    CHECK(fabs(q[0]) > 0.99); /* w stands first; it only falls */
    CHECK(sunder_value_array(value, "positoin", &a) == SUNDER_BAD_USAGE);
    sunder_error e;
    memset(&e, 0, sizeof e);
    e.struct_size = sizeof e;
    sunder_value_error(value, &e);
    CHECK(strstr(e.text, "positoin") != NULL);

    CHECK(sunder_graph_evaluate(graph, "bar.fragments", 1, NULL, &fragments) == SUNDER_OK);
    CHECK(sunder_value_part(fragments, "fragment_mesh", 0, &piece) == SUNDER_OK &&
          strcmp(sunder_value_type(piece), "mesh") == 0);
    sunder_value_free(piece);
    CHECK(sunder_value_part(fragments, "fragment_mesh", 16, &piece) == SUNDER_BAD_USAGE && piece == NULL);
    sunder_value_free(fragments);

    /* Cancelled by the host's answer: no value, and the graph works on. */
    sunder_value* none = (sunder_value*)&w;
    w.calls = 0, w.stop_after = 0;
    CHECK(sunder_graph_evaluate(graph, "sim.state", 4, &progress, &none) == SUNDER_CANCELLED && none == NULL);
    CHECK(error_of(graph).status == SUNDER_CANCELLED);
    sunder_value* next = NULL;
    CHECK(sunder_graph_evaluate(graph, "sim.state", 4, NULL, &next) == SUNDER_OK);
    CHECK(sunder_graph_seed_state(graph, "sim", 2, value) == SUNDER_OK);
    CHECK(sunder_graph_seed_state(graph, "clay", 2, value) == SUNDER_BAD_INPUT);
    sunder_value_free(next);
    sunder_value_free(value);
}

/* Several values of a frame at once; what fails leaves the others. */
static void several(sunder_graph* graph) {
    const char* const outputs[] = {"sim.state", "nobody.state", "bar.fragments", "no dot"};
    const char* const holed[] = {"sim.state", NULL};
    sunder_value* made[4] = {NULL, (sunder_value*)outputs, NULL, (sunder_value*)outputs};
    sunder_value* alone = NULL;
    struct watch w = {0, 1000000};
    sunder_progress progress = {sizeof(sunder_progress), on_progress, &w};
    sunder_array a, b;
    a.struct_size = sizeof a, b.struct_size = sizeof b;
    CHECK(sunder_graph_evaluate_all(graph, outputs, 4, 3, &progress, made) == SUNDER_BAD_INPUT);
    CHECK(strcmp(error_of(graph).node, "nobody") == 0 && made[1] == NULL && made[3] == NULL);
    CHECK(made[0] && strcmp(sunder_value_type(made[0]), "state") == 0);
    CHECK(made[2] && strcmp(sunder_value_type(made[2]), "fragments") == 0);
    CHECK(sunder_graph_evaluate(graph, "sim.state", 3, NULL, &alone) == SUNDER_OK);
    CHECK(sunder_value_array(made[0], "position", &a) == SUNDER_OK);
    CHECK(sunder_value_array(alone, "position", &b) == SUNDER_OK && a.data == b.data);
    sunder_value_free(alone), sunder_value_free(made[0]), sunder_value_free(made[2]);

    CHECK(sunder_graph_evaluate_all(graph, outputs, 1, 3, NULL, made) == SUNDER_OK && made[0] != NULL);
    sunder_value_free(made[0]);
    /* Half a frame later it has fallen further; a whole frame is what the integer call gives. */
    CHECK(sunder_graph_evaluate(graph, "sim.state", 3, NULL, &alone) == SUNDER_OK);
    CHECK(sunder_graph_evaluate_all_at(graph, outputs, 1, 3.5, NULL, made) == SUNDER_OK && made[0] != NULL);
    CHECK(sunder_value_array(made[0], "position", &a) == SUNDER_OK && a.shape[0] == 16);
    CHECK(sunder_value_array(alone, "position", &b) == SUNDER_OK);
    CHECK(((const double*)a.data)[2] < ((const double*)b.data)[2]);
    sunder_value_free(made[0]);
    CHECK(sunder_graph_evaluate_all_at(graph, outputs, 1, 3, NULL, made) == SUNDER_OK);
    CHECK(sunder_value_array(made[0], "position", &a) == SUNDER_OK && a.data == b.data);
    sunder_value_free(made[0]), sunder_value_free(alone);
    CHECK(sunder_graph_evaluate_all_at(graph, outputs, 1, NAN, NULL, made) == SUNDER_BAD_INPUT && made[0] == NULL);
    CHECK(sunder_graph_evaluate_all_at(graph, outputs, 1, 2.5, NULL, NULL) == SUNDER_BAD_USAGE);
    CHECK(sunder_graph_evaluate_all(graph, NULL, 0, 3, NULL, NULL) == SUNDER_OK);
    CHECK(sunder_graph_evaluate_all(graph, holed, 2, 3, NULL, made) == SUNDER_BAD_USAGE && made[0] == NULL);
    CHECK(sunder_graph_evaluate_all(graph, outputs, 1, 3, NULL, NULL) == SUNDER_BAD_USAGE);
    CHECK(sunder_graph_evaluate_all(NULL, outputs, 1, 3, NULL, made) == SUNDER_BAD_USAGE);
    w.calls = 0, w.stop_after = 0;
    CHECK(sunder_graph_set(graph, "clay", "density", "900") == SUNDER_OK);
    CHECK(sunder_graph_evaluate_all(graph, outputs, 3, 3, &progress, made) == SUNDER_CANCELLED);
    CHECK(made[0] == NULL && made[2] == NULL && w.calls == 1);
    CHECK(sunder_graph_reset(graph, "clay", "density") == SUNDER_OK);
}

static void files(sunder_graph* graph, const char* folder) {
    sunder_bake_settings settings;
    sunder_bake_report report;
    memset(&settings, 0, sizeof settings);
    memset(&report, 0, sizeof report);
    settings.struct_size = sizeof settings, settings.folder = folder, settings.start = SUNDER_BAKE_RESTART;
    settings.has_frames = 1, settings.first_frame = 1, settings.last_frame = 3;
    report.struct_size = sizeof report;
    CHECK(sunder_graph_bake(graph, &settings, NULL, &report) == SUNDER_OK);
    CHECK(report.n_frames == 3 && report.last_frame == 3 && report.bytes > 1000);
    settings.start = SUNDER_BAKE_FRESH;
    CHECK(sunder_graph_bake(graph, &settings, NULL, NULL) == SUNDER_BAD_INPUT);
    settings.start = 9;
    CHECK(sunder_graph_bake(graph, &settings, NULL, NULL) == SUNDER_BAD_USAGE);
    const char* json = NULL;
    CHECK(sunder_graph_verify_bake(graph, folder, NULL, &json) == SUNDER_OK && strstr(json, "\"faults\":[]") != NULL);
    CHECK(sunder_graph_report_bake(graph, folder, NULL, &json) == SUNDER_OK && strstr(json, "\"breaks\":[") != NULL);
    CHECK(sunder_graph_report_bake(graph, folder, "[1]", &json) == SUNDER_BAD_INPUT);
    CHECK(sunder_graph_report_bake(graph, folder, "{\"group\": \"none\"}", &json) == SUNDER_BAD_INPUT);
    CHECK(sunder_graph_report_bake(graph, NULL, NULL, &json) == SUNDER_BAD_USAGE);

    char path[1000];
    sunder_export_settings wanted;
    memset(&wanted, 0, sizeof wanted);
    snprintf(path, sizeof path, "%s/shot.usda", folder);
    wanted.struct_size = sizeof wanted, wanted.bake = folder, wanted.file = path;
    CHECK(sunder_graph_export_bake(graph, &wanted, NULL, &json) == SUNDER_BAD_INPUT); /* states alone, no mesh */
    CHECK(strstr(error_of(graph).what, "mesh frames") != NULL);
    wanted.bake = NULL;
    CHECK(sunder_graph_export_bake(graph, &wanted, NULL, &json) == SUNDER_BAD_USAGE);

    snprintf(path, sizeof path, "%s/state/sim.0002.ply", folder);
    sunder_value* state = NULL;
    CHECK(sunder_graph_read_state(graph, path, &state) == SUNDER_OK && strcmp(sunder_value_type(state), "state") == 0);
    sunder_value_free(state);
    snprintf(path, sizeof path, "%s/manifest.json", folder);
    CHECK(sunder_graph_read_state(graph, path, &state) == SUNDER_BAD_INPUT && state == NULL);
}

/* Work on the library's own thread, and what it gave. */
static void jobs(sunder_graph* graph, const char* folder) {
    sunder_job* job = NULL;
    sunder_job_state state;
    sunder_bake_report report;
    sunder_bake_settings settings;
    memset(&state, 0, sizeof state), memset(&report, 0, sizeof report), memset(&settings, 0, sizeof settings);
    state.struct_size = sizeof state, report.struct_size = sizeof report, settings.struct_size = sizeof settings;
    settings.folder = folder, settings.start = SUNDER_BAKE_RESTART;
    settings.has_frames = 1, settings.first_frame = 1, settings.last_frame = 3;
    CHECK(sunder_graph_start_evaluate(graph, "sim.state", 2, &job) == SUNDER_OK && job != NULL);
    CHECK(sunder_job_finish(job, NULL) == SUNDER_OK);
    sunder_job_free(job);
    CHECK(sunder_graph_start_evaluate(graph, "nobody.state", 2, &job) == SUNDER_OK);
    CHECK(sunder_job_finish(job, NULL) == SUNDER_BAD_INPUT && strstr(error_of(graph).text, "nobody") != NULL);
    sunder_job_free(job);
    const char* const outputs[] = {"sim.state", "bar.fragments", NULL};
    CHECK(sunder_graph_start_evaluate_all(graph, outputs, 2, 2, &job) == SUNDER_OK);
    CHECK(sunder_job_finish(job, NULL) == SUNDER_OK);
    sunder_job_free(job);
    CHECK(sunder_graph_start_evaluate_all_at(graph, outputs, 2, 2.5, &job) == SUNDER_OK);
    CHECK(sunder_job_finish(job, NULL) == SUNDER_OK);
    sunder_job_free(job);
    CHECK(sunder_graph_start_evaluate_all(graph, outputs, 3, 2, &job) == SUNDER_BAD_USAGE && job == NULL);
    CHECK(sunder_graph_start_evaluate_all(graph, outputs, 2, 2, NULL) == SUNDER_BAD_USAGE);
    CHECK(sunder_graph_start_bake(graph, &settings, &job) == SUNDER_OK);
    while (!sunder_job_wait(job, 1)) sunder_job_look(job, &state);
    sunder_job_look(job, &state);
    CHECK(!state.is_running && state.fraction > 0 && strlen(state.text) > 0);
    CHECK(sunder_job_finish(job, &report) == SUNDER_OK && report.n_frames == 3 && report.struct_size == sizeof report);
    sunder_job_free(job);
    settings.last_frame = 100000;
    CHECK(sunder_graph_start_bake(graph, &settings, &job) == SUNDER_OK);
    sunder_job_cancel(job);
    CHECK(sunder_job_finish(job, &report) == SUNDER_CANCELLED && error_of(graph).status == SUNDER_CANCELLED);
    sunder_job_free(job);
    CHECK(sunder_graph_start_bake(graph, &settings, &job) == SUNDER_OK);
    sunder_job_free(job); /* while it is at work */
    CHECK(sunder_graph_start_bake(graph, NULL, &job) == SUNDER_BAD_USAGE && job == NULL);
    CHECK(error_of(graph).status == SUNDER_BAD_USAGE && strstr(error_of(graph).what, "NULL") != NULL);
    CHECK(sunder_graph_start_evaluate(graph, "sim.state", 1, NULL) == SUNDER_BAD_USAGE);
    CHECK(error_of(graph).status == SUNDER_BAD_USAGE);
    sunder_job_look(NULL, &state), sunder_job_cancel(NULL), sunder_job_free(NULL);
    CHECK(sunder_job_wait(NULL, 1) == 1 && sunder_job_finish(NULL, NULL) == SUNDER_BAD_USAGE);
}

/* Every call on a graph that somebody has is refused, with nothing changed; returns how many were. */
static int refused(sunder_graph* graph, const char* folder, const char* sentence) {
    const char *json = NULL, *const outputs[] = {"sim.state"};
    sunder_value* value = NULL;
    sunder_job* job = NULL;
    sunder_bake_settings bake;
    sunder_export_settings export;
    memset(&bake, 0, sizeof bake), memset(&export, 0, sizeof export);
    bake.struct_size = sizeof bake, bake.folder = folder, bake.start = SUNDER_BAKE_RESTART;
    export.struct_size = sizeof export, export.bake = folder, export.file = "x.usda";
    int n = 0;
#define REFUSED(call)                                       \
    do {                                                    \
        CHECK((call) == SUNDER_BAD_USAGE);                  \
        CHECK(error_of(graph).status == SUNDER_BAD_USAGE);  \
        CHECK(strcmp(error_of(graph).text, sentence) == 0); \
        ++n;                                                \
    } while (0)
    REFUSED(sunder_graph_load(graph, "x.json"));
    REFUSED(sunder_graph_parse(graph, scene, "scene", ""));
    REFUSED(sunder_graph_save(graph, "x.json"));
    REFUSED(sunder_graph_json(graph, 0, &json));
    REFUSED(sunder_graph_add_node(graph, "wall", "collider"));
    REFUSED(sunder_graph_remove_node(graph, "clay"));
    REFUSED(sunder_graph_connect(graph, "clay.body", "sim.bodies"));
    REFUSED(sunder_graph_disconnect(graph, "sim.bodies"));
    REFUSED(sunder_graph_set(graph, "clay", "density", "5"));
    REFUSED(sunder_graph_get(graph, "clay", "density", &json));
    REFUSED(sunder_graph_get_at(graph, "clay", "density", 1, &json));
    REFUSED(sunder_graph_reset(graph, "clay", "density"));
    REFUSED(sunder_graph_set_frame_rate(graph, 25));
    REFUSED(sunder_graph_set_frame_ratio(graph, 24000, 1001));
    REFUSED(sunder_graph_set_frame_range(graph, 1, 3));
    REFUSED(sunder_graph_set_threads(graph, 1));
    REFUSED(sunder_graph_set_cache_limit(graph, 0));
    REFUSED(sunder_graph_set_base_folder(graph, "x"));
    REFUSED(sunder_graph_set_cut_folder(graph, "x"));
    REFUSED(sunder_graph_evaluate(graph, "sim.state", 2, NULL, &value));
    REFUSED(sunder_graph_evaluate_all(graph, outputs, 1, 2, NULL, &value));
    REFUSED(sunder_graph_evaluate_all_at(graph, outputs, 1, 2.5, NULL, &value));
    REFUSED(sunder_graph_read_state(graph, "x.ply", &value));
    REFUSED(sunder_graph_bake(graph, &bake, NULL, NULL));
    REFUSED(sunder_graph_verify_bake(graph, folder, NULL, &json));
    REFUSED(sunder_graph_report_bake(graph, folder, NULL, &json));
    REFUSED(sunder_graph_export_bake(graph, &export, NULL, &json));
    REFUSED(sunder_graph_start_evaluate(graph, "sim.state", 2, &job));
    REFUSED(sunder_graph_start_evaluate_all(graph, outputs, 1, 2, &job));
    REFUSED(sunder_graph_start_evaluate_all_at(graph, outputs, 1, 2.5, &job));
    REFUSED(sunder_graph_start_bake(graph, &bake, &job));
    CHECK(value == NULL && job == NULL);
    return n;
}

static const char* const job_runs = "a job of this graph is running (finish it first; cancel ends it soon)";
static const char* const call_runs = "another call on this graph is at work (wait for its end)";

struct meddler {
    sunder_graph* graph;
    const char* folder;
    int refused, is_to_free;
};

static int32_t on_progress_meddle(void* user, double fraction, const char* text) {
    struct meddler* m = user;
    (void)fraction, (void)text;
    if (m->refused == 0) m->refused = refused(m->graph, m->folder, call_runs);
    if (m->is_to_free) sunder_graph_free(m->graph), m->is_to_free = 0;
    return 1;
}

/* A graph that a job or a call has is nobody else's, and is freed only when they are through. */
static void one_thing_at_a_time(const char* folder) {
    sunder_graph *graph = NULL, *other = NULL;
    sunder_job* job = NULL;
    sunder_value *value = NULL, *early = NULL;
    const char* json = NULL;
    CHECK(sunder_graph_create(SUNDER_ABI_VERSION, &graph) == SUNDER_OK);
    CHECK(sunder_graph_create(SUNDER_ABI_VERSION, &other) == SUNDER_OK);
    CHECK(sunder_graph_parse(graph, scene, "scene", "") == SUNDER_OK);
    CHECK(sunder_graph_evaluate(graph, "sim.state", 2, NULL, &early) == SUNDER_OK);

    CHECK(sunder_graph_start_evaluate(graph, "sim.state", 100000, &job) == SUNDER_OK);
    for (int i = 0; i < 20; ++i) {
        CHECK(refused(graph, folder, job_runs) == 31);
        sunder_job_wait(job, 0.005);
    }
    CHECK(sunder_graph_seed_state(graph, "sim", 2, early) == SUNDER_BAD_USAGE);
    sunder_value_free(early);
    CHECK(sunder_graph_parse(other, scene, "scene", "") == SUNDER_OK && error_of(other).status == SUNDER_OK);
    CHECK(sunder_job_wait(job, 0) == 0); /* nobody was in its way */
    sunder_graph_cancel(graph);
    CHECK(sunder_job_wait(job, 60) == 1 && sunder_graph_json(graph, 0, &json) == SUNDER_BAD_USAGE);
    CHECK(sunder_job_finish(job, NULL) == SUNDER_CANCELLED && error_of(graph).status == SUNDER_CANCELLED);
    CHECK(sunder_graph_set(graph, "clay", "density", "900") == SUNDER_OK);
    CHECK(sunder_job_finish(job, NULL) == SUNDER_CANCELLED); /* as before; the graph is not its own any more */
    CHECK(sunder_graph_get(graph, "clay", "density", &json) == SUNDER_OK && strcmp(json, "900.0") == 0);
    sunder_job_free(job);

    struct meddler m = {graph, folder, 0, 0};
    const sunder_progress progress = {sizeof progress, on_progress_meddle, &m};
    CHECK(sunder_graph_evaluate(graph, "sim.state", 3, &progress, &value) == SUNDER_OK && m.refused == 31);
    CHECK(error_of(graph).status == SUNDER_OK);
    sunder_value_free(value);
    m.is_to_free = 1;
    CHECK(sunder_graph_evaluate(graph, "sim.state", 100000, &progress, &value) == SUNDER_CANCELLED && value == NULL);

    CHECK(sunder_graph_start_evaluate(other, "sim.state", 100000, &job) == SUNDER_OK);
    sunder_graph_free(other); /* with its job at work */
    CHECK(sunder_job_finish(job, NULL) == SUNDER_CANCELLED);
    sunder_job_free(job);
}

int main(int argc, char** argv) {
    sunder_graph* graph = NULL;
    if (argc != 2) return 2;
    CHECK(sunder_abi_version() == SUNDER_ABI_VERSION);
    CHECK(strlen(sunder_version()) >= 5);
    CHECK(strstr(sunder_node_types_json(), "\"prefracture\"") != NULL);
    CHECK(sunder_graph_create(SUNDER_ABI_VERSION + 1, &graph) == SUNDER_BAD_USAGE && graph == NULL);
    CHECK(sunder_graph_create(SUNDER_ABI_VERSION, &graph) == SUNDER_OK && graph != NULL);
    if (!graph) return 1;
    CHECK(sunder_graph_parse(graph, scene, "scene", "") == SUNDER_OK);
    edits_and_errors(graph);
    values(graph);
    several(graph);
    files(graph, argv[1]);
    jobs(graph, argv[1]);
    one_thing_at_a_time(argv[1]);
    sunder_graph_free(graph);
    printf("%d failures\n", failures);
    return failures != 0;
}
