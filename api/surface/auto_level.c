/* Levels are chosen by bounds that lib proves (tw_surface_errors), each mesh by itself. */
#include "auto_level.h"

#include <math.h>

#include "service.h"
#include "tweend/anim.h"

/* ---- scales and sizes -------------------------------------------------------------------------- */

/* The most that a matrix lengthens a vector: the root of the greatest eigenvalue of its square, in closed
 * form. */
static double greatest_scale(const float matrix[16]) {
  double square[3][3], mean = 0, spread = 0, determinant;
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) {
      square[i][k] = 0;
      for (int row = 0; row < 3; row++)
        square[i][k] += (double)matrix[4 * i + row] * (double)matrix[4 * k + row];
    }
  for (int i = 0; i < 3; i++) mean += square[i][i] / 3;
  for (int i = 0; i < 3; i++) square[i][i] -= mean;
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) spread += square[i][k] * square[i][k] / 6;
  spread = sqrt(spread);
  if (!(spread > 1e-12 * mean)) return sqrt(mean);
  determinant = square[0][0] * (square[1][1] * square[2][2] - square[1][2] * square[2][1]) -
                square[0][1] * (square[1][0] * square[2][2] - square[1][2] * square[2][0]) +
                square[0][2] * (square[1][0] * square[2][1] - square[1][1] * square[2][0]);
  double third = acos(fmax(-1, fmin(1, determinant / (2 * spread * spread * spread)))) / 3;
  return sqrt(mean + 2 * spread * cos(third));
}

typedef struct box {
  double low[3], high[3];
} box;

static const box empty = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void widen(box *b, const double point[3]) {
  for (int c = 0; c < 3; c++) {
    b->low[c] = fmin(b->low[c], point[c]);
    b->high[c] = fmax(b->high[c], point[c]);
  }
}

static box box_of(const tw_mesh *mesh) {
  box b = empty;
  for (uint32_t i = 0; i < mesh->corner_count; i++) {
    const float *at = mesh->positions + 3 * (size_t)mesh->corners[i];
    widen(&b, (const double[3]){(double)at[0], (double)at[1], (double)at[2]});
  }
  return b;
}

static double diagonal(const box *b) {
  double square = 0;
  for (int c = 0; c < 3; c++) square += (b->high[c] - b->low[c]) * (b->high[c] - b->low[c]);
  return b->high[0] >= b->low[0] ? sqrt(square) : 0;
}

/* Widens a box by one that a matrix places. */
static void widen_placed(box *b, const box *by, const float matrix[16]) {
  for (int corner = 0; corner < 8 && by->high[0] >= by->low[0]; corner++) {
    double placed[3];
    for (int row = 0; row < 3; row++) {
      placed[row] = (double)matrix[12 + row];
      for (int c = 0; c < 3; c++)
        placed[row] += (double)matrix[4 * c + row] * (corner >> c & 1 ? by->high[c] : by->low[c]);
    }
    widen(b, placed);
  }
}

/* How the scene shows its meshes. */
typedef struct showing {
  const tw_scene *scene;
  box *boxes;     /* [meshes] of each cage */
  double *scales; /* [meshes] the greatest; 1 where no node shows the mesh */
  box all;        /* as the scene has them */
} showing;

/* Joints place a skinned mesh, as they rest or are posed. A point lies between where single joints place it.
 */
static tw_status show_skinned(showing *s, uint32_t mesh, const tw_skin *skin, const float *world,
                              tw_arena *arena) {
  float *matrices = tw_arena_alloc(arena, skin->joint_count, 16 * sizeof *matrices);
  if (!matrices) return TW_NO_MEMORY;
  tw_skin_matrices(skin, world, matrices);
  for (uint32_t j = 0; j < skin->joint_count; j++) {
    widen_placed(&s->all, &s->boxes[mesh], matrices + 16 * (size_t)j);
    s->scales[mesh] = fmax(s->scales[mesh], greatest_scale(matrices + 16 * (size_t)j));
  }
  return TW_OK;
}

/* Instances place a mesh, or its node alone. */
static tw_status show_places(showing *s, uint32_t node, const float world[16]) {
  enum { PLACES_AT_ONCE = 64, PLACE_WORK = 256 };
  const tw_model *model = s->scene->model;
  uint32_t mesh = model->nodes[node].mesh;
  uint64_t count = tw_node_times_shown(model, node);
  for (uint64_t first = 0; first < count; first += PLACES_AT_ONCE) {
    float places[PLACES_AT_ONCE][16];
    uint32_t some = count - first < PLACES_AT_ONCE ? (uint32_t)(count - first) : PLACES_AT_ONCE;
    if (!tw_work((uint64_t)some * PLACE_WORK)) return TW_CANCELLED;
    tw_node_places(model, node, world, (uint32_t)first, some, places);
    for (uint32_t i = 0; i < some; i++) {
      widen_placed(&s->all, &s->boxes[mesh], places[i]);
      s->scales[mesh] = fmax(s->scales[mesh], greatest_scale(places[i]));
    }
  }
  return TW_OK;
}

static tw_status show_nodes(showing *s, tw_arena *arena) {
  const tw_model *model = s->scene->model;
  float *world = tw_arena_alloc(arena, model->node_count, 16 * sizeof *world);
  tw_trs *locals = tw_arena_alloc(arena, model->node_count, sizeof *locals);
  if (!world || !locals) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < model->node_count; i++)
    locals[i] = s->scene->pose ? s->scene->pose[i] : model->nodes[i].rest;
  tw_pose_locals(s->scene->posed_by, model->nodes, model->node_count, locals, world);
  tw_pose_world(model->nodes, model->node_order, model->node_count, world, world);
  for (uint32_t i = 0; i < model->node_count; i++) {
    const tw_node *node = &model->nodes[i];
    const float *matrix = world + 16 * (size_t)i;
    if (node->mesh == TW_NO_INDEX || node->is_hidden) continue;
    if (node->skin != TW_NO_INDEX && model->meshes[node->mesh].skin.joints) {
      tw_status status = show_skinned(s, node->mesh, &model->skins[node->skin], world, arena);
      if (status != TW_OK) return status;
      continue;
    }
    tw_status status = show_places(s, i, matrix);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

static tw_status find_showing(const tw_scene *scene, tw_arena *arena, showing *out) {
  const tw_model *model = scene->model;
  *out = (showing){.scene = scene, .all = empty};
  out->boxes = tw_arena_alloc(arena, model->mesh_count, sizeof *out->boxes);
  out->scales = tw_arena_alloc(arena, model->mesh_count, sizeof *out->scales);
  if (!out->boxes || !out->scales) return TW_NO_MEMORY;
  for (uint32_t i = 0; i < model->mesh_count; i++) out->boxes[i] = box_of(&model->meshes[i]);
  tw_status status = show_nodes(out, arena);
  for (uint32_t i = 0; i < model->mesh_count && status == TW_OK; i++) {
    if (out->scales[i] > 0) continue;
    out->scales[i] = 1;
    if (diagonal(&out->all) == 0) out->all = out->boxes[i];
  }
  return status;
}

static api_outcome show(api_call *call, const tw_scene *scene, showing *out) {
  enum { LIGHT_PLACES = 4096 };
  uint64_t places = scene->model->node_count;
  for (uint32_t i = 0; i < scene->model->node_count; i++) places += tw_node_times_shown(scene->model, i);
  if (call->effort != API_HEAVY && places > LIGHT_PLACES) return API_NEEDS_THREAD;
  tw_status status = find_showing(scene, call->arena, out);
  if (status == TW_NO_MEMORY) return api_fail_without_memory(call);
  return api_outcome_of(call, status == TW_CANCELLED ? tw_work_status(&call->fault.error) : status);
}

/* ---- errors ------------------------------------------------------------------------------------ */

/* The errors of meshes in their own space, as they are cached. */
typedef struct mesh_errors {
  uint32_t count, levels;
  double of_mesh[]; /* [count][levels] */
} mesh_errors;

typedef struct errors_source {
  api_call *call;
  const api_surface_scene *scene;
  const showing *shown;
  uint32_t levels;
  double enough; /* a distance in the scene */
} errors_source;

static tw_status find_errors(const errors_source *source, tw_arena *scratch, mesh_errors *out,
                             tw_error *error) {
  const api_surface_scene *scene = source->scene;
  for (uint32_t i = 0; i < out->count; i++) {
    uint32_t of = scene->moves.count > 0 ? scene->moves.of[i] : i;
    tw_mesh mesh;
    api_hard hard = {0};
    tw_status status = api_plan_cage(scene->query, &scene->meshes.meshes[of], scratch, &mesh, &hard, error);
    if (status != TW_OK) return status;
    if (scene->moves.count > 0 && scene->moves.positions[i]) mesh.positions = scene->moves.positions[i];
    tw_surface_options options = api_surface_options(scene->query, of, &mesh);
    const tw_error_wish wish = {.level_max = out->levels - 1,
                                .enough = source->enough / source->shown->scales[i]};
    status = tw_surface_errors(&mesh, &options, &wish, &source->call->service->parallel,
                               out->of_mesh + (size_t)i * out->levels, error);
    if (status != TW_OK) return status;
  }
  return TW_OK;
}

static bool build_errors(void *context, api_built *out, api_fault *fault) {
  const errors_source *source = context;
  const api_surface_scene *scene = source->scene;
  uint32_t count = scene->moves.count > 0 ? scene->moves.count : scene->meshes.count;
  uint64_t bound = 0;
  for (uint32_t i = 0; i < scene->meshes.count; i++) {
    uint64_t more = api_surface_bound(&scene->meshes.meshes[i], 2);
    bound = more > bound ? more : bound;
  }
  if (!api_grant(source->call, bound)) return false;
  size_t size = sizeof(mesh_errors) + (size_t)count * source->levels * sizeof(double);
  mesh_errors *errors = tw_alloc_zero(1, size);
  tw_arena *scratch = tw_arena_create();
  tw_status status = TW_NO_MEMORY;
  if (errors && scratch) {
    errors->count = count;
    errors->levels = source->levels;
    status = find_errors(source, scratch, errors, &fault->error);
  }
  tw_arena_destroy(scratch);
  if (status != TW_OK) {
    tw_free(errors);
    return status == TW_NO_MEMORY ? api_fault_without_memory(fault) : api_fault_complete(fault);
  }
  *out = (api_built){errors, size, tw_free, API_CACHED_PLAN};
  return true;
}

/* The key of the errors; NULL without memory. */
static const char *make_key(api_call *call, const errors_source *source) {
  const api_surface_scene *scene = source->scene;
  const char *parameters = api_surface_key_print(call, scene->query, API_KEY_ERRORS, "/errors?");
  tw_text text = {0};
  if (!parameters) return NULL;
  tw_text_add(&text, parameters);
  tw_text_add(&text, scene->meshes.uses ? "&skin=bake&" : "&");
  tw_text_count(&text, source->levels);
  tw_text_add(&text, "/");
  tw_text_double(&text, source->enough);
  return api_text_move(&text, call->arena);
}

/* ---- rungs ------------------------------------------------------------------------------------- */

/* Errors are looked at in rungs: what is enough is a share of the scene's size, on each rung a 16th of that
 * on the one before. So wishes that are near each other share what is cached. The error that is told of a
 * level is that of the first rung on which it is not below what is enough, as closer looks tell about the
 * same (tw_error_wish), else of the last one. Thus a level has one number, whoever asks. Wishes that are
 * smaller than what is enough on the last rung look at further ones. */
enum { NO_RUNG = -1, RUNG_LAST = 2, RUNG_FINEST = 5 };

static double rung_of(const api_level_errors *errors, int rung) {
  return ldexp(errors->size, -4 * (rung + 2));
}

/* Takes the errors of a rung in the spaces of the meshes, brings them to the scene's, and puts them in place
 * of those that were below what is enough on the rung before; NO_RUNG: in place of all. keeps_less: what was
 * found before stays where it is less. */
static api_outcome take_rung(errors_source *source, int rung, int before, bool keeps_less,
                             api_level_errors *out) {
  api_call *call = source->call;
  const api_surface_scene *scene = source->scene;
  bool is_cached = scene->is_stored && scene->moves.count == 0; /* moved meshes are the request's own */
  source->enough = rung_of(out, rung);
  const char *key = is_cached ? make_key(call, source) : NULL;
  api_entry *entry = NULL;
  if (is_cached && !key) return api_fail_without_memory(call);
  if (!is_cached && call->effort != API_HEAVY) return API_NEEDS_THREAD;
  api_outcome outcome = api_call_take(call, key, build_errors, source, &entry);
  if (outcome != API_DONE) return outcome;
  const mesh_errors *found = api_entry_value(entry);
  size_t size = (size_t)out->count * out->levels;
  for (size_t i = 0; i < size; i++) {
    double now = found->of_mesh[i] * source->shown->scales[i / out->levels], *told = &out->of_mesh[i];
    if (before != NO_RUNG && *told >= rung_of(out, before)) continue;
    *told = keeps_less && before != NO_RUNG ? fmin(*told, now) : now;
  }
  api_entry_release(entry);
  return API_DONE;
}

/* Begins with no errors. */
static api_outcome begin(api_call *call, const api_surface_scene *scene, const showing *shown,
                         errors_source *source, api_level_errors *out) {
  uint32_t levels = call->service->limits.max_level + 1;
  *source = (errors_source){call, scene, shown, levels, 0};
  *out = (api_level_errors){.levels = levels,
                            .count = scene->moves.count > 0 ? scene->moves.count : scene->meshes.count,
                            .size = diagonal(&shown->all)};
  out->of_mesh = tw_arena_alloc(call->arena, (size_t)out->count * levels, sizeof *out->of_mesh);
  return out->of_mesh ? API_DONE : api_fail_without_memory(call);
}

api_outcome api_level_errors_take(api_call *call, const api_surface_scene *scene, api_level_errors *out) {
  showing shown;
  errors_source source;
  api_outcome outcome = show(call, &scene->content, &shown);
  if (outcome == API_DONE) outcome = begin(call, scene, &shown, &source, out);
  for (int rung = 0; outcome == API_DONE && rung <= RUNG_LAST; rung++)
    outcome = take_rung(&source, rung, rung - 1, false, out);
  return outcome;
}

double api_level_error_of(const api_level_errors *errors, uint32_t level) {
  double most = 0;
  for (uint32_t i = 0; i < errors->count; i++)
    most = fmax(most, errors->of_mesh[(size_t)i * errors->levels + level]);
  return most;
}

/* ---- the choice -------------------------------------------------------------------------------- */

/* What is asked for. */
typedef struct wish {
  double error;   /* in the scene; INFINITY: any */
  uint32_t level; /* the highest that may be chosen */
  bool is_held;   /* by a number of faces, so that the error may be missed */
} wish;

/* The highest level at which all meshes together have at most so many faces; 0 where none has. */
static tw_status find_highest(api_call *call, const api_surface_scene *scene, uint64_t faces, uint32_t *out) {
  api_surface_query query = *scene->query;
  tw_surface_counts counts;
  query.auto_level.levels = NULL;
  query.level = 1;
  tw_status status = api_plan_count(call, &scene->meshes, &query, &counts);
  if (status != TW_OK && status != TW_LIMIT) return status;
  uint64_t count = counts.faces;
  *out = 0;
  while (*out < call->service->limits.max_level && count <= faces) {
    (*out)++;
    count = count > UINT64_MAX / 4 ? UINT64_MAX : 4 * count;
  }
  return TW_OK;
}

static api_outcome make_wish(api_call *call, const api_surface_scene *scene, double size, wish *out) {
  const api_auto_level *asked = &scene->query->auto_level;
  const api_limits *limits = &call->service->limits;
  double error = asked->error;
  uint64_t faces = asked->faces;
  *out = (wish){.error = INFINITY, .level = limits->max_level, .is_held = faces > 0};
  if (size == 0 && asked->is_share) {
    out->level = 0; /* all levels are one point */
    return API_DONE;
  }
  if (error > 0) out->error = asked->is_share ? error * size : error;
  if (!out->is_held) return API_DONE;
  if (faces > limits->max_faces) faces = limits->max_faces;
  return api_outcome_of(call, find_highest(call, scene, faces, &out->level));
}

/* The least level within the error; the highest allowed where none is, or any error will do. */
static uint32_t choose_level(const wish *w, const double *errors) {
  uint32_t level = 0;
  if (isinf(w->error)) return w->level;
  while (level < w->level && !(errors[level] <= w->error)) level++;
  return level;
}

/* The first of some rungs with no more than a wish, or the last of them. */
static int find_rung(const api_level_errors *errors, const wish *w, int first, int last) {
  while (first < last && rung_of(errors, first) > w->error) first++;
  return first;
}

/* Whether what is known of the levels that a wish chooses is what is told of them. */
static bool are_told(const api_level_errors *errors, const wish *w, int rung) {
  bool are = rung >= RUNG_LAST;
  for (uint32_t i = 0; i < errors->count && !are; i++) {
    const double *own = errors->of_mesh + (size_t)i * errors->levels;
    if (own[choose_level(w, own)] < rung_of(errors, rung)) return false;
  }
  return true;
}

/* Finds the errors that a wish needs. Rungs with more than the wish would tell of levels with more than it.
 */
static api_outcome find_wished(errors_source *source, const wish *w, api_level_errors *errors) {
  int rung = find_rung(errors, w, 0, RUNG_LAST), before = NO_RUNG;
  api_outcome outcome = take_rung(source, rung, before, true, errors);
  while (outcome == API_DONE && !are_told(errors, w, rung)) {
    before = rung++;
    outcome = take_rung(source, rung, before, true, errors);
  }
  if (outcome != API_DONE || rung < RUNG_LAST || rung_of(errors, rung) <= w->error) return outcome;
  return take_rung(source, find_rung(errors, w, RUNG_LAST + 1, RUNG_FINEST), RUNG_LAST, true, errors);
}

/* Chooses the levels of the plan's meshes; one that the scene has moved several times gets the highest of
 * them. */
static api_outcome choose_levels(api_call *call, const api_surface_scene *scene, const wish *w,
                                 const api_level_errors *errors) {
  api_auto_level *chosen = &scene->query->auto_level;
  uint32_t *levels = tw_arena_alloc(call->arena, scene->meshes.count, sizeof *levels);
  double *reached = tw_arena_alloc(call->arena, errors->count, sizeof *reached);
  if (!levels || !reached) return api_fail_without_memory(call);
  scene->query->level = 0;
  for (uint32_t i = 0; i < errors->count; i++) {
    uint32_t *level = &levels[scene->moves.count > 0 ? scene->moves.of[i] : i],
             own = choose_level(w, errors->of_mesh + (size_t)i * errors->levels);
    if (own > *level) *level = own;
    if (own > scene->query->level) scene->query->level = own;
  }
  for (uint32_t i = 0; i < errors->count; i++) {
    uint32_t level = levels[scene->moves.count > 0 ? scene->moves.of[i] : i];
    reached[i] = errors->of_mesh[(size_t)i * errors->levels + level];
    chosen->reached = fmax(chosen->reached, reached[i]);
  }
  chosen->levels = levels;
  chosen->level_count = scene->meshes.count;
  chosen->errors = reached;
  return API_DONE;
}

/* Tells the levels, the lowest and the highest where meshes differ, and the error. */
static void tell(api_call *call, const api_surface_query *query) {
  const api_auto_level *chosen = &query->auto_level;
  char number[TW_NUMBER_TEXT + 1];
  uint64_t lowest = query->level;
  for (uint32_t i = 0; i < chosen->level_count; i++)
    if (chosen->levels[i] < lowest) lowest = chosen->levels[i];
  if (lowest == query->level)
    api_answer_headerf(&call->answer, "X-Tweend-Level", "%llu", (unsigned long long)lowest);
  else
    api_answer_headerf(&call->answer, "X-Tweend-Level", "%llu-%llu", (unsigned long long)lowest,
                       (unsigned long long)query->level);
  if (!isfinite(chosen->reached)) return;
  number[tw_print_double(number, chosen->reached)] = 0; /* all digits, as in JSON: it may be asked for */
  api_answer_headerf(&call->answer, "X-Tweend-Error", "surface=%s", number);
}

/* An error that is asked for by itself is a promise: without it there is no answer. Beside a number of faces,
 * the lower level wins, and the answer tells its error. */
static api_outcome check_reached(api_call *call, const api_surface_query *query, const wish *w) {
  double reached = query->auto_level.reached;
  if (!(reached > w->error)) return API_DONE;
  if (!w->is_held)
    return api_fail_with(
        call, 422,
        "level=auto: level %u, the highest, stays within %.4g of the limit surface, not within %.4g",
        w->level, reached, w->error);
  tw_text text = {0};
  tw_text_add(&text, "level=auto: within ");
  tw_text_float(&text, (float)reached);
  tw_text_add(&text, " of the limit surface, not within ");
  tw_text_float(&text, (float)w->error);
  tw_text_add(&text, ", which needs more faces");
  return api_call_warn_text(call, &text);
}

api_outcome api_level_choose(api_call *call, api_surface_scene *scene) {
  showing shown;
  wish w;
  api_level_errors errors;
  errors_source source;
  api_outcome outcome = show(call, &scene->content, &shown);
  if (outcome == API_DONE) outcome = make_wish(call, scene, diagonal(&shown.all), &w);
  if (outcome == API_DONE) outcome = begin(call, scene, &shown, &source, &errors);
  if (outcome == API_DONE) outcome = find_wished(&source, &w, &errors);
  if (outcome == API_DONE) outcome = choose_levels(call, scene, &w, &errors);
  if (outcome == API_DONE) outcome = check_reached(call, scene->query, &w);
  if (outcome == API_DONE) tell(call, scene->query);
  return outcome;
}
