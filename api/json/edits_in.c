/* Reads edits in tweend JSON; each kind has its own members. */
#include "edits_in.h"

#include <string.h>

#include "tweend/json_print.h"

/* ---- selections ------------------------------------------------------------------------------ */

enum { LIST_MAX = 65536 }; /* the most edits in a list */

enum { BY_GROUP, BY_MATERIAL, BY_FACING, BY_WITHIN, BY_INSIDE, BY_MADE, BY_LOOP, BY_RING, BY_SHARPER, BYS };

static tw_status read_box(void *context, const api_value *object) {
  static const char *const names[] = {"min", "max", NULL};
  tw_selection *out = context;
  api_value corners[2];
  tw_status status = api_json_members(object, names, corners);
  for (int i = 0; i < 2 && status == TW_OK; i++) {
    if (!corners[i].item) return api_json_fail(object, TW_SYNTAX, "a box needs min and max");
    status = api_json_doubles(&corners[i], 3, i == 0 ? out->min : out->max);
  }
  return status;
}

/* Reads an edge as two vertices. out: [2] */
static tw_status read_edge(const api_value *value, uint32_t *out) {
  uint32_t count;
  tw_status status = api_json_count(value, UINT32_MAX, &count);
  if (status == TW_OK && count != 2)
    status = api_json_fail(value, TW_SYNTAX, "the two vertices of an edge are expected");
  return status == TW_OK ? api_json_index_list(value, out) : status;
}

static tw_status read_loop(const api_value *value, tw_selection *out) {
  uint32_t *edge = tw_arena_alloc(value->json->arena, 2, sizeof *edge);
  out->indices = edge;
  out->count = 1;
  return edge ? read_edge(value, edge) : api_json_no_memory(value->json);
}

static tw_status read_degrees(const api_value *value, double *out) {
  tw_status status = api_json_double(value, out);
  if (status == TW_OK && !(*out >= 0 && *out <= 180))
    return api_json_fail(value, TW_INVALID, "an angle from 0 to 180 degrees is expected");
  return status;
}

static tw_status read_facing(const api_value *values, tw_selection *out) {
  out->degrees = 45;
  tw_status status = api_json_doubles(&values[BY_FACING], 3, out->direction);
  if (status == TW_OK) status = read_degrees(&values[BY_WITHIN], &out->degrees);
  const double *d = out->direction;
  if (status == TW_OK && d[0] == 0 && d[1] == 0 && d[2] == 0)
    return api_json_fail(&values[BY_FACING], TW_INVALID, "a direction of length 0");
  return status;
}

/* Reads a material by index or name. */
static tw_status read_material(const api_value *value, tw_selection *out) {
  return cJSON_IsString(value->item) ? api_json_name(value, &out->name)
                                     : api_json_index(value, &out->material);
}

static tw_status read_by(const api_value *values, int by, tw_selection *out) {
  switch (by) {
  case BY_GROUP: out->by = TW_SELECT_GROUP; return api_json_name(&values[by], &out->name);
  case BY_MATERIAL: out->by = TW_SELECT_MATERIAL; return read_material(&values[by], out);
  case BY_FACING: out->by = TW_SELECT_FACING; return read_facing(values, out);
  case BY_INSIDE: out->by = TW_SELECT_INSIDE; return api_json_object(&values[by], read_box, out);
  case BY_MADE: out->by = TW_SELECT_MADE; return api_json_name(&values[by], &out->name);
  case BY_LOOP: out->by = TW_SELECT_LOOP; return read_loop(&values[by], out);
  case BY_RING: out->by = TW_SELECT_RING; return read_loop(&values[by], out);
  default: out->by = TW_SELECT_SHARPER; return read_degrees(&values[by], &out->degrees);
  }
}

static tw_status read_selection_object(void *context, const api_value *object) {
  static const char *const names[3][BYS + 1] = {
      {"group", "material", "facing", "within", "inside", "made", NULL},
      {"inside", "made", "loop", "ring", "sharper_than", NULL},
      {"inside", "made", NULL}};
  static const int bys[3][BYS] = {{BY_GROUP, BY_MATERIAL, BY_FACING, BY_WITHIN, BY_INSIDE, BY_MADE},
                                  {BY_INSIDE, BY_MADE, BY_LOOP, BY_RING, BY_SHARPER},
                                  {BY_INSIDE, BY_MADE}};
  tw_selection *out = context;
  api_value found[BYS], values[BYS] = {0};
  int chosen = -1;
  tw_status status = api_json_members(object, names[out->of], found);
  if (status != TW_OK) return status;
  for (size_t i = 0; names[out->of][i]; i++) {
    int by = bys[out->of][i];
    values[by] = found[i];
    if (!found[i].item || by == BY_WITHIN) continue;
    if (chosen >= 0) return api_json_fail(&found[i], TW_SYNTAX, "a selection is by one thing alone");
    chosen = by;
  }
  if (values[BY_WITHIN].item && chosen != BY_FACING)
    return api_json_fail(&values[BY_WITHIN], TW_SYNTAX, "within is for facing");
  char list[200];
  tw_names_join(names[out->of], list, sizeof list);
  if (chosen < 0)
    return api_json_fail(object, TW_SYNTAX, "%s are selected by one of %s", tw_edit_element_names[out->of],
                         list);
  return read_by(values, chosen, out);
}

static tw_status read_pairs(const api_value *array, tw_selection *out) {
  tw_arena *arena = array->json->arena;
  uint32_t *offsets = tw_arena_alloc_raw(arena, (size_t)out->count + 1, sizeof *offsets);
  uint32_t *pairs = tw_arena_alloc_raw(arena, out->count, 2 * sizeof *pairs);
  if (!offsets || !pairs) return api_json_no_memory(array->json);
  tw_status status = api_json_index_offsets(array, offsets);
  for (uint32_t i = 0; i < out->count && status == TW_OK; i++) {
    if (offsets[i + 1] == 2 * (i + 1)) continue;
    const api_value pair = {array->json, NULL, {&array->at, NULL, i}};
    status = api_json_fail(&pair, TW_SYNTAX, "the two vertices of an edge are expected");
  }
  out->indices = pairs;
  return status == TW_OK ? api_json_index_rows(array, pairs) : status;
}

static tw_status read_selection_list(const api_value *array, tw_selection *out) {
  out->by = TW_SELECT_LIST;
  tw_status status = api_json_count(array, UINT32_MAX, &out->count);
  if (status != TW_OK || out->count == 0) return status;
  if (out->of == TW_EDIT_EDGES) return read_pairs(array, out);
  uint32_t *indices = tw_arena_alloc_raw(array->json->arena, out->count, sizeof *indices);
  if (!indices) return api_json_no_memory(array->json);
  out->indices = indices;
  return api_json_index_list(array, indices);
}

static tw_status read_selection(const api_value *value, tw_edit_element of, tw_selection *out) {
  static const char *const words[] = {"all", "border", NULL}, *const all[] = {"all", NULL};
  if (!value->item) return TW_OK;
  if (out->by != TW_SELECT_NOTHING)
    return api_json_fail(value, TW_SYNTAX, "an edit has one selection: %s are given already",
                         tw_edit_element_names[out->of]);
  out->of = of;
  if (cJSON_IsArray(value->item)) return read_selection_list(value, out);
  if (cJSON_IsObject(value->item)) return api_json_object(value, read_selection_object, out);
  int word = 0;
  tw_status status = api_json_choice(value, of == TW_EDIT_EDGES ? words : all, &word);
  out->by = word == 0 ? TW_SELECT_ALL : TW_SELECT_BORDER;
  return status;
}

/* ---- members --------------------------------------------------------------------------------- */

enum {
  EDIT,
  NAME,
  OPTIONAL,
  FACES,
  EDGES,
  VERTICES,
  DISTANCE,
  BY,
  INDIVIDUAL,
  AMOUNT,
  EDGE,
  CUTS,
  AT,
  TO,
  BORDER,
  MAX_EDGES,
  METHOD,
  AXIS,
  WELD,
  DEGREES,
  ABOUT,
  SHARPNESS,
  FACTOR,
  ITERATIONS,
  MEMBERS
};
static const char *const names[MEMBERS] = {
    "edit",       "name",   "optional", "faces",   "edges", "vertices",  "distance", "by",
    "individual", "amount", "edge",     "cuts",    "at",    "to",        "border",   "max_edges",
    "method",     "axis",   "weld",     "degrees", "about", "sharpness", "factor",   "iterations"};

#define HAS(member) (1u << (member))
#define ANY         (HAS(FACES) | HAS(EDGES) | HAS(VERTICES))
/* The members of each kind; edit, name and optional belong to all. */
static const uint32_t members_of[TW_EDIT_KINDS] = {
    [TW_EDIT_EXTRUDE] = HAS(FACES) | HAS(DISTANCE) | HAS(BY) | HAS(INDIVIDUAL),
    [TW_EDIT_INSET] = HAS(FACES) | HAS(AMOUNT) | HAS(INDIVIDUAL),
    [TW_EDIT_LOOP_CUT] = HAS(EDGE) | HAS(CUTS) | HAS(AT),
    [TW_EDIT_SUBDIVIDE] = HAS(FACES) | HAS(EDGES) | HAS(CUTS),
    [TW_EDIT_DELETE] = ANY,
    [TW_EDIT_MERGE] = HAS(VERTICES) | HAS(DISTANCE) | HAS(TO),
    [TW_EDIT_FILL] = HAS(BORDER) | HAS(MAX_EDGES) | HAS(METHOD),
    [TW_EDIT_MIRROR] = HAS(AXIS) | HAS(WELD),
    [TW_EDIT_MOVE] = ANY | HAS(BY),
    [TW_EDIT_ROTATE] = ANY | HAS(AXIS) | HAS(DEGREES) | HAS(ABOUT),
    [TW_EDIT_SCALE] = ANY | HAS(BY) | HAS(ABOUT),
    [TW_EDIT_CREASE] = HAS(EDGES) | HAS(SHARPNESS),
    [TW_EDIT_CORNER] = HAS(VERTICES) | HAS(SHARPNESS),
    [TW_EDIT_HOLE] = HAS(FACES) | HAS(SHARPNESS),
    [TW_EDIT_FLIP] = HAS(FACES),
    [TW_EDIT_ORIENT] = HAS(FACES),
    [TW_EDIT_TRIANGULATE] = HAS(FACES),
    [TW_EDIT_QUADS] = HAS(FACES),
    [TW_EDIT_DROP_PIECES] = HAS(FACES),
    [TW_EDIT_DESPIKE] = ANY | HAS(FACTOR),
    [TW_EDIT_SMOOTH] = ANY | HAS(METHOD) | HAS(ITERATIONS)};

/* `weld` is an edit kind of the document only: a merge of all vertices. */
enum { WELD_ALL = TW_EDIT_KINDS, KINDS };

static tw_status need(const api_value *value) {
  if (value->item) return TW_OK;
  return api_json_fail(value, TW_SYNTAX, "the edit needs %s", value->at.name);
}

static tw_status read_vector(const api_value *value, bool *has, double *out) {
  if (has) *has = value->item;
  return api_json_doubles(value, 3, out);
}

/* ---- kinds ----------------------------------------------------------------------------------- */

static tw_status read_extrude(const api_value *values, tw_edit *edit) {
  tw_status status = read_vector(&values[BY], &edit->extrude.has_by, edit->extrude.by);
  if (status == TW_OK && edit->extrude.has_by && values[DISTANCE].item)
    return api_json_fail(&values[DISTANCE], TW_SYNTAX, "an extrusion goes by a distance or by a vector");
  if (status == TW_OK && !edit->extrude.has_by) status = need(&values[DISTANCE]);
  if (status == TW_OK) status = api_json_double(&values[DISTANCE], &edit->extrude.distance);
  return status == TW_OK ? api_json_flag(&values[INDIVIDUAL], &edit->extrude.is_individual) : status;
}

static tw_status read_inset(const api_value *values, tw_edit *edit) {
  tw_status status = need(&values[AMOUNT]);
  if (status == TW_OK) status = api_json_double(&values[AMOUNT], &edit->inset.amount);
  return status == TW_OK ? api_json_flag(&values[INDIVIDUAL], &edit->inset.is_individual) : status;
}

static tw_status read_loop_cut(const api_value *values, tw_edit *edit) {
  uint32_t at_count;
  edit->loop_cut.cuts = 1;
  tw_status status = need(&values[EDGE]);
  if (status == TW_OK) status = read_edge(&values[EDGE], edit->loop_cut.edge);
  if (status == TW_OK) status = api_json_count(&values[AT], TW_EDIT_CUTS_MAX, &at_count);
  if (status == TW_OK && values[AT].item) edit->loop_cut.cuts = at_count;
  if (status == TW_OK) status = api_json_index(&values[CUTS], &edit->loop_cut.cuts);
  if (status != TW_OK || !values[AT].item) return status;
  if (at_count != edit->loop_cut.cuts)
    return api_json_fail(&values[AT], TW_INVALID, "there %s %u %s for %u %s",
                         tw_plural(at_count, "is", "are"), at_count, tw_plural(at_count, "place", "places"),
                         edit->loop_cut.cuts, tw_plural(edit->loop_cut.cuts, "cut", "cuts"));
  if (at_count == 0 && !values[CUTS].item)
    return api_json_fail(&values[AT], TW_INVALID, "an edge is cut 1 to %d times", TW_EDIT_CUTS_MAX);
  double *at = tw_arena_alloc(values[AT].json->arena, at_count, sizeof *at);
  if (!at) return api_json_no_memory(values[AT].json);
  edit->loop_cut.at = at;
  return api_json_double_list(&values[AT], at);
}

static tw_status read_subdivide(const api_value *values, tw_edit *edit) {
  edit->subdivide.cuts = 1;
  return api_json_index(&values[CUTS], &edit->subdivide.cuts);
}

/* distance -1: merge vertices at any distance. */
static tw_status read_merge(const api_value *values, tw_edit *edit) {
  edit->merge.distance = -1;
  if (values[DISTANCE].item && values[TO].item)
    return api_json_fail(&values[TO], TW_SYNTAX, "vertices are merged within a distance, or to a point");
  tw_status status = api_json_double(&values[DISTANCE], &edit->merge.distance);
  if (status == TW_OK && values[DISTANCE].item && edit->merge.distance < 0)
    return api_json_fail(&values[DISTANCE], TW_INVALID, "a distance is 0 or more");
  return status == TW_OK ? read_vector(&values[TO], &edit->merge.has_to, edit->merge.to) : status;
}

static tw_status read_fill(const api_value *values, tw_edit *edit) {
  static const char *const methods[] = {
      [TW_FILL_NGON] = "ngon", [TW_FILL_TRIANGLES] = "triangles", [TW_FILL_FAIR] = "fair", NULL};
  int method = 0;
  edit->fill.has_border = values[BORDER].item;
  tw_status status = edit->fill.has_border ? read_edge(&values[BORDER], edit->fill.border) : TW_OK;
  if (status == TW_OK) status = api_json_index(&values[MAX_EDGES], &edit->fill.max_edges);
  if (status == TW_OK) status = api_json_choice(&values[METHOD], methods, &method);
  edit->fill.method = (tw_fill_method)method;
  return status;
}

static const char *const axes[] = {"x", "y", "z", NULL};

/* Reads a distance, or whether points on the plane are merged with their image. */
static tw_status read_mirror_weld(const api_value *value, double *out) {
  *out = cJSON_IsFalse(value->item) ? -1 : 1e-6;
  return cJSON_IsBool(value->item) ? TW_OK : api_json_double(value, out);
}

static tw_status read_mirror(const api_value *values, tw_edit *edit) {
  tw_status status = need(&values[AXIS]);
  if (status == TW_OK) status = api_json_choice(&values[AXIS], axes, &edit->mirror.axis);
  return status == TW_OK ? read_mirror_weld(&values[WELD], &edit->mirror.weld) : status;
}

static tw_status read_move(const api_value *values, tw_edit *edit) {
  tw_status status = need(&values[BY]);
  return status == TW_OK ? read_vector(&values[BY], NULL, edit->move.by) : status;
}

/* Reads a rotation; its axis is a letter or a vector. */
static tw_status read_rotate(const api_value *values, tw_edit *edit) {
  tw_status status = need(&values[AXIS]);
  if (status == TW_OK) status = need(&values[DEGREES]);
  double *axis = edit->rotate.axis;
  if (status == TW_OK && cJSON_IsString(values[AXIS].item)) {
    int letter = 0;
    status = api_json_choice(&values[AXIS], axes, &letter);
    axis[letter] = 1;
  } else if (status == TW_OK) {
    status = read_vector(&values[AXIS], NULL, axis);
    if (status == TW_OK && axis[0] == 0 && axis[1] == 0 && axis[2] == 0)
      return api_json_fail(&values[AXIS], TW_INVALID, "an axis of length 0");
  }
  if (status == TW_OK) status = api_json_double(&values[DEGREES], &edit->rotate.degrees);
  return status == TW_OK ? read_vector(&values[ABOUT], &edit->rotate.has_about, edit->rotate.about) : status;
}

/* Reads a scaling by one number, or by one for each axis. */
static tw_status read_scale(const api_value *values, tw_edit *edit) {
  tw_status status = need(&values[BY]);
  double *by = edit->scale.by;
  if (status == TW_OK && cJSON_IsNumber(values[BY].item)) {
    status = api_json_double(&values[BY], by);
    by[1] = by[2] = by[0];
  } else if (status == TW_OK) {
    status = read_vector(&values[BY], NULL, by);
  }
  return status == TW_OK ? read_vector(&values[ABOUT], &edit->scale.has_about, edit->scale.about) : status;
}

static tw_status read_sharpness(const api_value *values, tw_edit *edit) {
  edit->sharpness = (double)TW_SHARPNESS_INFINITE;
  tw_status status = api_json_double(&values[SHARPNESS], &edit->sharpness);
  if (status == TW_OK && edit->sharpness < 0)
    return api_json_fail(&values[SHARPNESS], TW_INVALID, "sharpness is 0 or more");
  if (edit->sharpness > (double)TW_SHARPNESS_INFINITE) edit->sharpness = (double)TW_SHARPNESS_INFINITE;
  return status;
}

/* `faces` is a number here, not a selection. */
static tw_status read_drop_pieces(const api_value *values, tw_edit *edit) {
  tw_status status = need(&values[FACES]);
  return status == TW_OK ? api_json_index(&values[FACES], &edit->drop_pieces.faces) : status;
}

static tw_status read_despike(const api_value *values, tw_edit *edit) {
  edit->despike.factor = 2;
  return api_json_double(&values[FACTOR], &edit->despike.factor);
}

static tw_status read_smooth(const api_value *values, tw_edit *edit) {
  static const char *const methods[] = {
      [TW_SMOOTH_TAUBIN] = "taubin", [TW_SMOOTH_LAPLACIAN] = "laplacian", NULL};
  int method = TW_SMOOTH_TAUBIN;
  tw_status status = api_json_choice(&values[METHOD], methods, &method);
  edit->smooth.method = (tw_smooth_method)method;
  edit->smooth.iterations = 10;
  return status == TW_OK ? api_json_index(&values[ITERATIONS], &edit->smooth.iterations) : status;
}

static tw_status read_parameters(const api_value *values, tw_edit *edit) {
  switch (edit->kind) {
  case TW_EDIT_EXTRUDE: return read_extrude(values, edit);
  case TW_EDIT_INSET: return read_inset(values, edit);
  case TW_EDIT_LOOP_CUT: return read_loop_cut(values, edit);
  case TW_EDIT_SUBDIVIDE: return read_subdivide(values, edit);
  case TW_EDIT_MERGE: return read_merge(values, edit);
  case TW_EDIT_FILL: return read_fill(values, edit);
  case TW_EDIT_MIRROR: return read_mirror(values, edit);
  case TW_EDIT_MOVE: return read_move(values, edit);
  case TW_EDIT_ROTATE: return read_rotate(values, edit);
  case TW_EDIT_SCALE: return read_scale(values, edit);
  case TW_EDIT_CREASE:
  case TW_EDIT_CORNER:
  case TW_EDIT_HOLE: return read_sharpness(values, edit);
  case TW_EDIT_DROP_PIECES: return read_drop_pieces(values, edit);
  case TW_EDIT_DESPIKE: return read_despike(values, edit);
  case TW_EDIT_SMOOTH: return read_smooth(values, edit);
  case TW_EDIT_DELETE:
  case TW_EDIT_FLIP:
  case TW_EDIT_ORIENT:
  case TW_EDIT_TRIANGULATE:
  case TW_EDIT_QUADS: break;
  }
  return TW_OK;
}

/* Reads a weld: merges vertices at equal positions, or within a distance. */
static tw_status read_weld(const api_value *values, tw_edit *edit) {
  edit->kind = TW_EDIT_MERGE;
  edit->selection = (tw_selection){.of = TW_EDIT_VERTICES, .by = TW_SELECT_ALL};
  tw_status status = read_merge(values, edit);
  if (!values[DISTANCE].item) edit->merge.distance = 0;
  return status;
}

static tw_status read_edit(void *context, const api_value *object) {
  static const int selections[3] = {FACES, EDGES, VERTICES};
  tw_edit *edit = (tw_edit *)context + object->at.index;
  api_value values[MEMBERS];
  int kind = 0;
  const char *kinds[KINDS + 1] = {[WELD_ALL] = "weld"};
  memcpy(kinds, tw_edit_names, sizeof tw_edit_names);
  tw_status status = api_json_kind(object, names[EDIT], kinds, "an edit needs a kind, edit", &kind);
  bool is_weld = kind == WELD_ALL;
  if (status != TW_OK) return status;
  uint32_t members = HAS(EDIT) | HAS(NAME) | HAS(OPTIONAL) | (is_weld ? HAS(DISTANCE) : members_of[kind]);
  status = api_json_members_of(object, names, MEMBERS, members, values);
  if (status != TW_OK) return status;
  *edit = (tw_edit){.kind = is_weld ? TW_EDIT_MERGE : (tw_edit_kind)kind};
  status = api_json_name(&values[NAME], &edit->name);
  if (status == TW_OK) status = api_json_flag(&values[OPTIONAL], &edit->is_optional);
  for (int of = 0; of < 3 && status == TW_OK && kind != TW_EDIT_DROP_PIECES; of++)
    status = read_selection(&values[selections[of]], (tw_edit_element)of, &edit->selection);
  if (status != TW_OK) return status;
  return is_weld ? read_weld(values, edit) : read_parameters(values, edit);
}

/* Reads a list of edits: [*count], in the arena. tw_mesh_edit checks them against the mesh. */
static tw_status read_edits(const api_value *array, tw_edit **out, uint32_t *count) {
  tw_status status = api_json_count(array, LIST_MAX, count);
  if (status != TW_OK) return status;
  *out = tw_arena_alloc(array->json->arena, *count, sizeof **out);
  if (!*out) return api_json_no_memory(array->json);
  return api_json_each(array, read_edit, *out);
}

/* ---- applying -------------------------------------------------------------------------------- */

/* Bytes that edits hold for each point and corner; the least room, in points and corners, of the first
 * attempt; and how many edits may each process a mesh that fills the room. */
enum { EDIT_BYTES = 256, FIRST_ROOM = 1 << 16, EDITS_OF_MOST = 16 };

/* Moves the places that an edit names into the frame of a mesh that lies far from the origin. */
static tw_status enter_frame(const api_value *object, const double origin[3], tw_edit *edit) {
  double *places[] = {edit->selection.min, edit->selection.max, NULL};
  if (edit->kind == TW_EDIT_MERGE) places[2] = edit->merge.to;
  if (edit->kind == TW_EDIT_ROTATE) places[2] = edit->rotate.about;
  if (edit->kind == TW_EDIT_SCALE) places[2] = edit->scale.about;
  for (size_t i = 0; i < sizeof places / sizeof *places && places[i]; i++)
    for (int c = 0; c < 3; c++) places[i][c] -= origin[c];
  if (edit->kind == TW_EDIT_MIRROR && origin[edit->mirror.axis] != 0)
    return api_json_fail(object, TW_INVALID,
                         "mirror reflects at %s = 0, from which the mesh lies so far that floats would lose "
                         "the shape of both",
                         axes[edit->mirror.axis]);
  return TW_OK;
}

static tw_status enter_frames(const api_value *array, const double origin[3], tw_edit *edits,
                              uint32_t count) {
  tw_status status = TW_OK;
  for (uint32_t i = 0; i < count && status == TW_OK; i++) {
    const api_value object = {array->json, NULL, {&array->at, NULL, i}};
    status = enter_frame(&object, origin, &edits[i]);
  }
  return status;
}

/* The size of what edits make is known only when they are applied: they begin with little room, and are
 * applied anew with more where it does not suffice. */
tw_status api_edits_apply(const api_value *array, const api_edit_call *call, tw_mesh *out,
                          api_edits_done *done) {
  const api_json *json = array->json;
  const api_making *making = call->making;
  tw_edit *edits;
  uint32_t count, named;
  tw_edit_losses losses;
  tw_status status = read_edits(array, &edits, &count);
  if (status == TW_OK) status = enter_frames(array, call->mesh->origin, edits, count);
  if (status != TW_OK) return status;
  tw_made *list = tw_arena_alloc(json->arena, count, sizeof *list);
  if (!list) return api_json_no_memory(json);
  uint64_t most = making->bytes_max / EDIT_BYTES;
  uint64_t room = FIRST_ROOM + 4 * ((uint64_t)call->mesh->point_count + call->mesh->corner_count);
  do {
    if (room > most) room = most;
    const tw_edit_limits limits = {.points = room,
                                   .faces = room < making->faces_max ? room : making->faces_max,
                                   .corners = room,
                                   .work = EDITS_OF_MOST * room,
                                   .parallel = making->parallel};
    status = tw_mesh_edit(call->mesh, call->model, edits, count, &limits, json->arena, out, list, &named,
                          &losses, json->error);
    if (room == most) break;
    room *= 8;
  } while (status == TW_LIMIT);
  if (status == TW_NO_MEMORY || status == TW_CANCELLED) return status;
  if (status != TW_OK) return api_json_fail_within(array, status);
  if (!done) return TW_OK;
  *done = (api_edits_done){.made = list, .made_count = named, .losses = losses};
  for (uint32_t i = 0; i < count; i++) done->has_mirrored |= edits[i].kind == TW_EDIT_MIRROR;
  return TW_OK;
}
