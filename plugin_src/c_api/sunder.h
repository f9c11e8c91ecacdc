/* Sunder's C interface: the one door through which every host (Python, Blender, engines) comes.
 *
 * Rules that hold everywhere
 *  - Text is UTF-8 and ends in 0. Text and arrays that a handle gives out belong to it.
 *  - A function that can fail returns a sunder_status; sunder_graph_error / sunder_value_error tell the rest, until the
 *    next call on that handle. No exception leaves the library.
 *  - Structs begin with their size: set it to sizeof(the struct) so that later versions may append members.
 *  - A handle is used by one thread at a time; sunder_graph_cancel alone may be called from any. Different handles are
 *    independent, and a value outlives the graph it came from.
 *  - A graph does one thing at a time. A call on it is refused (SUNDER_BAD_USAGE, nothing changes) while a job of it
 *    has not been finished, and while another call on it is at work, also from that one's progress function.
 *    sunder_graph_cancel, sunder_graph_error and sunder_graph_free are never refused.
 *  - SI units; Z up; quaternions are (w, x, y, z); matrices are row-major.
 */
#ifndef SUNDER_H
#define SUNDER_H

#include <stdint.h>

#if defined(_WIN32)
#define SUNDER_API __declspec(dllexport)
#else
#define SUNDER_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Grows when something that was there changes; additions leave it. */
#define SUNDER_ABI_VERSION 1u

SUNDER_API uint32_t sunder_abi_version(void);
SUNDER_API const char* sunder_version(void); /* "0.2.0" */

typedef int32_t sunder_status;
enum {
    SUNDER_OK = 0,
    SUNDER_BAD_USAGE = 1, /* the call itself is wrong */
    SUNDER_BAD_INPUT = 2, /* a file, mesh, graph, parameter or wire is wrong */
    SUNDER_IO = 3,        /* reading or writing failed */
    SUNDER_NUMERICAL = 4, /* numbers went bad */
    SUNDER_CANCELLED = 5, /* somebody asked to stop; not a fault */
    SUNDER_INTERNAL = 6   /* our bug */
};

/* What went wrong last on a handle. Members that do not apply are "". */
typedef struct sunder_error {
    uint32_t struct_size;
    sunder_status status;
    const char* text; /* "WHERE: WHAT (how to mend it)" */
    const char *where, *what, *mend;
    const char *node, *parameter; /* of the graph, concerned */
} sunder_error;

/* Called now and then during long work, on the thread that asked for it, with a fraction in [0, 1]. Returns 0 to
 * cancel. */
typedef int32_t (*sunder_progress_function)(void* user, double fraction, const char* text);

typedef struct sunder_progress {
    uint32_t struct_size;
    sunder_progress_function function; /* may be NULL */
    void* user;
} sunder_progress;

/* ---- Node types ---- */

/* {"sunder": VERSION, "nodes": [...]}: every node type with its sockets and parameters. Lives as long as
 * the library. */
SUNDER_API const char* sunder_node_types_json(void);

/* ---- Graphs ---- */

typedef struct sunder_graph sunder_graph;

/* `abi_version` is SUNDER_ABI_VERSION of the header that the host was compiled with. Fails (SUNDER_BAD_USAGE, NULL in
 * `out_graph`) if the library does not speak it. The graph has the latest version of graph files; one that is parsed or
 * loaded has its own, which decides what parameters are that are left out. */
SUNDER_API sunder_status sunder_graph_create(uint32_t abi_version, sunder_graph** out_graph);
/* With a call or job at work: cancels it. The graph then goes when the call returns, or with the job
 * (sunder_job_finish, sunder_job_free). */
SUNDER_API void sunder_graph_free(sunder_graph* graph);
SUNDER_API void sunder_graph_error(const sunder_graph* graph, sunder_error* out_error);

/* Replace what the graph holds; on an error it stays as it was. `where` names the text in errors; input paths are seen
 * from `base_folder`. */
SUNDER_API sunder_status sunder_graph_load(sunder_graph* graph, const char* path);
SUNDER_API sunder_status sunder_graph_parse(sunder_graph* graph, const char* json, const char* where,
                                            const char* base_folder);
SUNDER_API sunder_status sunder_graph_save(sunder_graph* graph, const char* path);
/* The graph file's text; with `all_defaults` parameters left at their default are written too. */
SUNDER_API sunder_status sunder_graph_json(sunder_graph* graph, int32_t all_defaults, const char** out_json);

SUNDER_API sunder_status sunder_graph_add_node(sunder_graph* graph, const char* name, const char* type);
SUNDER_API sunder_status sunder_graph_remove_node(sunder_graph* graph, const char* name);
/* "node.output" to "node.input". A single input's wire is replaced, a list gets one more. */
SUNDER_API sunder_status sunder_graph_connect(sunder_graph* graph, const char* output, const char* input);
SUNDER_API sunder_status sunder_graph_disconnect(sunder_graph* graph, const char* input);

/* Parameters as JSON text: a value, null, or {"keys": [[frame, value], ...]}; "auto" where a description says
 * "automatic". Inputs too: "@node.socket" or a list. */
SUNDER_API sunder_status sunder_graph_set(sunder_graph* graph, const char* node, const char* name, const char* json);
SUNDER_API sunder_status sunder_graph_get(sunder_graph* graph, const char* node, const char* name,
                                          const char** out_json);
/* A parameter's value at a frame, animation worked out. */
SUNDER_API sunder_status sunder_graph_get_at(sunder_graph* graph, const char* node, const char* parameter, double frame,
                                             const char** out_json);
SUNDER_API sunder_status sunder_graph_reset(sunder_graph* graph, const char* node, const char* parameter);

SUNDER_API sunder_status sunder_graph_set_frame_rate(sunder_graph* graph, double frames_per_second);
/* So many frames in so many seconds, both whole: 24000 in 1001. */
SUNDER_API sunder_status sunder_graph_set_frame_ratio(sunder_graph* graph, int32_t frames, int32_t seconds);
SUNDER_API sunder_status sunder_graph_set_frame_range(sunder_graph* graph, int32_t first, int32_t last);
SUNDER_API sunder_status sunder_graph_set_threads(sunder_graph* graph, int32_t threads); /* 0: all cores */
/* Of past frames that each solver keeps. */
SUNDER_API sunder_status sunder_graph_set_cache_limit(sunder_graph* graph, uint64_t bytes);
SUNDER_API sunder_status sunder_graph_set_base_folder(sunder_graph* graph, const char* folder);
/* What prefracture nodes cut is kept there and not cut again, also by another graph later; "" (default): nowhere. */
SUNDER_API sunder_status sunder_graph_set_cut_folder(sunder_graph* graph, const char* folder);

/* Stops what is being evaluated or baked; it returns SUNDER_CANCELLED as soon as its data are whole. */
SUNDER_API void sunder_graph_cancel(sunder_graph* graph);

/* ---- Values ---- */

typedef struct sunder_value sunder_value;

typedef int32_t sunder_array_type;
enum { SUNDER_UINT8 = 0, SUNDER_INT32 = 1, SUNDER_UINT32 = 2, SUNDER_FLOAT32 = 3, SUNDER_FLOAT64 = 4 };

/* Row-major, without gaps. */
typedef struct sunder_array {
    uint32_t struct_size;
    sunder_array_type type;
    const void* data; /* lives as long as the value; NULL if there are no elements */
    uint32_t rank;
    uint64_t shape[4]; /* the first `rank` count */
} sunder_array;

/* The value of "node.socket" at a frame. `progress` may be NULL. Free what you get. */
SUNDER_API sunder_status sunder_graph_evaluate(sunder_graph* graph, const char* output, int32_t frame,
                                               const sunder_progress* progress, sunder_value** out_value);
/* The values of `n_outputs` outputs at a frame, as sunder_graph_evaluate gives them one by one, bit for bit; sooner,
 * since deformers make their meshes side by side. out_values[i] is of outputs[i], or NULL if that one failed: the
 * status and the graph's error are of the first such, and the others are there. Free what you get. */
SUNDER_API sunder_status sunder_graph_evaluate_all(sunder_graph* graph, const char* const* outputs, uint32_t n_outputs,
                                                   int32_t frame, const sunder_progress* progress,
                                                   sunder_value** out_values);
/* The same at any frame, also between two: 12.5, which is blended of what is simulated. */
SUNDER_API sunder_status sunder_graph_evaluate_all_at(sunder_graph* graph, const char* const* outputs,
                                                      uint32_t n_outputs, double frame, const sunder_progress* progress,
                                                      sunder_value** out_values);
/* A state frame that a bake wrote. Errors are told by the graph. */
SUNDER_API sunder_status sunder_graph_read_state(sunder_graph* graph, const char* path, sunder_value** out_value);
/* Makes a solver continue from a state (of "solver.state", or read from a file) at a frame. What was simulated of later
 * frames is forgotten; the state given last stays, however small the cache. */
SUNDER_API sunder_status sunder_graph_seed_state(sunder_graph* graph, const char* node, int32_t frame,
                                                 const sunder_value* state);
/* The same for looking at that frame alone, also of a state that lies between two simulated frames: what is asked of
 * later frames goes on from it as if it were one of these, and is of no use. */
SUNDER_API sunder_status sunder_graph_show_state(sunder_graph* graph, const char* node, int32_t frame,
                                                 const sunder_value* state);

SUNDER_API void sunder_value_free(sunder_value* value);
SUNDER_API void sunder_value_error(const sunder_value* value, sunder_error* out_error);
SUNDER_API const char* sunder_value_type(const sunder_value* value); /* "state", "visual_mesh", ... */
SUNDER_API uint32_t sunder_value_array_count(const sunder_value* value);
SUNDER_API const char* sunder_value_array_name(const sunder_value* value, uint32_t index); /* NULL behind the last */
SUNDER_API sunder_status sunder_value_array(sunder_value* value, const char* name, sunder_array* out_array);
/* Whatever is no array: names, poses, materials, counts. */
SUNDER_API sunder_status sunder_value_info(sunder_value* value, const char** out_json);
/* A value made of this one: "fragment_mesh" of fragments. Free what you get. */
SUNDER_API sunder_status sunder_value_part(sunder_value* value, const char* name, uint64_t index,
                                           sunder_value** out_value);

/* ---- Files ---- */

enum { SUNDER_BAKE_FRESH = 0, SUNDER_BAKE_RESUME = 1, SUNDER_BAKE_RESTART = 2 };

typedef struct sunder_bake_settings {
    uint32_t struct_size;
    int32_t start; /* SUNDER_BAKE_... */
    const char* folder;
    int32_t has_frames, first_frame, last_frame; /* has_frames 0: the graph's range */
} sunder_bake_settings;

typedef struct sunder_bake_report {
    uint32_t struct_size;
    int32_t first_frame, last_frame;   /* wanted */
    int32_t first_new_frame;           /* those before it were there already */
    uint64_t n_frames, n_files, bytes; /* written now */
    const char* notes; /* ["node 'sim': ...", ...], JSON: what solvers and exports warn of; valid until the
                        * next call on the graph */
} sunder_bake_report;

/* `progress` and `out_report` may be NULL. A cancelled bake leaves whole frames and can be resumed. */
SUNDER_API sunder_status sunder_graph_bake(sunder_graph* graph, const sunder_bake_settings* settings,
                                           const sunder_progress* progress, sunder_bake_report* out_report);
/* {"files": N, "bytes": N, "faults": [...], "missing_frames": [...]} of a bake compared with its manifest. */
SUNDER_API sunder_status sunder_graph_verify_bake(sunder_graph* graph, const char* folder,
                                                  const sunder_progress* progress, const char** out_json);
/* What broke in a bake, when and why (docs/report.md tells the fields), complete or not. `fragments` names those whose
 * largest loads are told, too: {"all": true, "body": NAME, "fragments": [1, 2], "box": [[x, y, z], [x, y, z]], "group":
 * NAME, "cluster": 3}, each of which may be absent; NULL: none. Errors are told by the graph, which is not read. */
SUNDER_API sunder_status sunder_graph_report_bake(sunder_graph* graph, const char* folder, const char* fragments,
                                                  const char** out_json);
typedef struct sunder_export_settings {
    uint32_t struct_size;
    int32_t overwrite; /* 0: a file that is there already is an error */
    const char* bake;  /* folder */
    const char* file;  /* its ending tells the format: .usda, .glb, .pc2, .####.ply, .####.obj */
    const char* node;  /* bake_mesh node whose mesh is written; NULL or "": all of them */
    int32_t has_frames, first_frame, last_frame; /* has_frames 0: all that are baked */
    double tolerance; /* .glb: how far vertices may be from their rigid fragments, as a share of their body's size */
} sunder_export_settings;

/* A bake as other programs read it: {"frames": [first, last], "files": [...], "note": TEXT}. Errors are told by the
 * graph, which is not read. */
SUNDER_API sunder_status sunder_graph_export_bake(sunder_graph* graph, const sunder_export_settings* settings,
                                                  const sunder_progress* progress, const char** out_json);
/* fragments.json and pieces/ of fragments. Errors are told by the value. */
SUNDER_API sunder_status sunder_value_write_fragments(sunder_value* value, const char* folder,
                                                      const sunder_progress* progress);

/* ---- Jobs ---- */

/* Long work on a thread of the library's own, for hosts that cannot have threads call back into them (Python inside
 * Blender). The graph is the job's until it was finished or freed, though its work have ended: calls on the graph are
 * refused until then. sunder_job_look, _cancel and _wait are for the thread that started it. */
typedef struct sunder_job sunder_job;

typedef struct sunder_job_state {
    uint32_t struct_size;
    int32_t is_running;
    double fraction;  /* [0, 1] */
    const char* text; /* what it is at; until the next look */
} sunder_job_state;

/* As sunder_graph_evaluate; a later call for the same value finds it done. */
SUNDER_API sunder_status sunder_graph_start_evaluate(sunder_graph* graph, const char* output, int32_t frame,
                                                     sunder_job** out_job);
/* As sunder_graph_evaluate_all; later calls for these values find them done. */
SUNDER_API sunder_status sunder_graph_start_evaluate_all(sunder_graph* graph, const char* const* outputs,
                                                         uint32_t n_outputs, int32_t frame, sunder_job** out_job);
/* As sunder_graph_evaluate_all_at. */
SUNDER_API sunder_status sunder_graph_start_evaluate_all_at(sunder_graph* graph, const char* const* outputs,
                                                            uint32_t n_outputs, double frame, sunder_job** out_job);
/* As sunder_graph_bake. */
SUNDER_API sunder_status sunder_graph_start_bake(sunder_graph* graph, const sunder_bake_settings* settings,
                                                 sunder_job** out_job);
SUNDER_API void sunder_job_look(sunder_job* job, sunder_job_state* out_state);
SUNDER_API void sunder_job_cancel(sunder_job* job);
SUNDER_API int32_t sunder_job_wait(sunder_job* job, double seconds); /* 1 once it has ended */
/* Waits for the end, gives the graph back and tells what the call would have given; errors are told by the graph.
 * `out_report` may be NULL. */
SUNDER_API sunder_status sunder_job_finish(sunder_job* job, sunder_bake_report* out_report);
SUNDER_API void sunder_job_free(sunder_job* job); /* cancels it and waits, if it runs */

#ifdef __cplusplus
}
#endif
#endif
