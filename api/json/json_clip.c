/* tweend JSON: clips and their tracks. Times, key values and what fits what are checked by
 * tw_clip_create, when the model is finished. */
#include "json_in.h"

#include <string.h>

enum {
  NODE,
  PATH,
  INTERPOLATION,
  ORDER,
  UNIT,
  TIMES,
  QUATERNIONS,
  EULERS,
  AXIS_ANGLES,
  VALUES,
  IN_TANGENTS,
  OUT_TANGENTS,
  MEMBERS
};
static const char *const members[] = {
    "node",   "path",        "interpolation", "order",       "unit",         "times", "quaternions",
    "eulers", "axis_angles", "values",        "in_tangents", "out_tangents", NULL};

/* In a radian. */
static const double DEGREES = 57.295779513082320877;

/* The members of the track under way. */
typedef struct track_source {
  const api_json *json;
  const api_place *at;
  const cJSON *values[MEMBERS];
  api_place places[MEMBERS];
} track_source;

static tw_status fail_at(const track_source *source, int member, tw_status status, const char *detail) {
  return api_json_fail(source->json, &source->places[member], status, "%s", detail);
}

/* ---- what the track is ------------------------------------------------------------------------ */

static tw_status read_interpolation(const track_source *source, tw_track_keys *track) {
  /* slerp is glTF's LINEAR by its own name. */
  enum { SLERP = TW_EULER + 1 };
  static const char *const choices[] = {"step",  "linear", "cubicspline", "nlerp",
                                        "squad", "euler",  "slerp",       NULL};
  int choice = TW_LINEAR;
  tw_status status = api_json_choice(source->json, &source->places[INTERPOLATION],
                                     source->values[INTERPOLATION], choices, &choice);
  if (status != TW_OK) return status;
  bool for_all = choice == TW_STEP || choice == TW_LINEAR || choice == TW_CUBICSPLINE;
  if (track->path != TW_ROTATION && !for_all)
    return fail_at(source, INTERPOLATION, TW_INVALID, "this interpolation is for rotations");
  track->interpolation = choice == SLERP ? TW_LINEAR : (tw_interpolation)choice;
  return TW_OK;
}

/* The one member that holds the keys. */
static tw_status find_keys(const track_source *source, const tw_track_keys *track, int *member) {
  static const int forms[] = {QUATERNIONS, EULERS, AXIS_ANGLES, VALUES};
  *member = -1;
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    if (!source->values[forms[i]]) continue;
    if (*member >= 0)
      return api_json_fail(source->json, &source->places[forms[i]], TW_SYNTAX,
                           "the keys are given as %s already", members[*member]);
    *member = forms[i];
  }
  bool is_rotation = track->path == TW_ROTATION;
  if (*member < 0)
    return api_json_fail(source->json, source->at, TW_SYNTAX, "the track has no %s",
                         is_rotation ? "quaternions, eulers or axis_angles" : "values");
  if (is_rotation == (*member == VALUES))
    return fail_at(source, *member, TW_SYNTAX,
                   is_rotation ? "a rotation's keys are quaternions, eulers or axis_angles"
                               : "only rotations have such keys");
  return TW_OK;
}

/* ---- keys -------------------------------------------------------------------------------------- */

static tw_status read_times(const track_source *source, tw_track_keys *track) {
  const api_json *json = source->json;
  const cJSON *array = source->values[TIMES];
  if (!array) return api_json_fail(json, source->at, TW_SYNTAX, "the track has no times");
  tw_status status = api_json_array(json, &source->places[TIMES], array, &track->key_count);
  if (status != TW_OK) return status;
  if (track->key_count == 0) return fail_at(source, TIMES, TW_INVALID, "a track needs a key");
  float *times = tw_arena_alloc(json->arena, track->key_count, sizeof *times);
  if (!times) return api_json_no_memory(json);
  api_place place = {&source->places[TIMES], NULL, 0};
  for (const cJSON *item = array->child; item; item = item->next, place.index++) {
    status = api_json_float(json, &place, item, &times[place.index]);
    if (status != TW_OK) return status;
  }
  track->times = times;
  return TW_OK;
}

/* An array of a row a key. */
static tw_status check_row_count(const track_source *source, int member, uint32_t count, uint32_t keys) {
  if (count == keys) return TW_OK;
  return api_json_fail(source->json, &source->places[member], TW_INVALID, "%u keys for %u times", count,
                       keys);
}

static tw_status read_rows(const track_source *source, int member, const tw_track_keys *track, float **out) {
  uint32_t count = 0;
  if (!source->values[member])
    return api_json_fail(source->json, source->at, TW_SYNTAX, "the track has no %s", members[member]);
  tw_status status =
      api_json_rows(source->json, &source->places[member], source->values[member], track->width, &count, out);
  return status == TW_OK ? check_row_count(source, member, count, track->key_count) : status;
}

/* Values and both tangents as glTF interleaves them. */
static tw_status read_spline(const track_source *source, int member, tw_track_keys *track) {
  const int parts[] = {IN_TANGENTS, member, OUT_TANGENTS};
  size_t width = track->width;
  float *values = tw_arena_alloc(source->json->arena, track->key_count, 3 * width * sizeof *values);
  if (!values) return api_json_no_memory(source->json);
  for (size_t part = 0; part < 3; part++) {
    float *rows = NULL;
    tw_status status = read_rows(source, parts[part], track, &rows);
    if (status != TW_OK || !rows) return status;
    for (size_t key = 0; key < track->key_count; key++)
      memcpy(values + (key * 3 + part) * width, rows + key * width, width * sizeof *values);
  }
  track->values = values;
  return TW_OK;
}

static tw_status read_values(const track_source *source, int member, tw_track_keys *track) {
  if (track->interpolation == TW_CUBICSPLINE) return read_spline(source, member, track);
  static const int tangents[] = {IN_TANGENTS, OUT_TANGENTS};
  for (int i = 0; i < 2; i++)
    if (source->values[tangents[i]])
      return fail_at(source, tangents[i], TW_SYNTAX, "tangents are for cubicspline");
  float *values = NULL;
  tw_status status = read_rows(source, member, track, &values);
  if (status == TW_OK) track->values = values;
  return status;
}

/* Euler triples or axis-angle keys, in radians. */
static tw_status read_angles(const track_source *source, int member, tw_track_keys *track) {
  static const char *const orders[] = {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", NULL};
  static const char *const units[] = {"radians", "degrees", NULL};
  const api_json *json = source->json;
  int order = TW_XYZ, unit = 0;
  tw_status status = api_json_choice(json, &source->places[ORDER], source->values[ORDER], orders, &order);
  if (status == TW_OK)
    status = api_json_choice(json, &source->places[UNIT], source->values[UNIT], units, &unit);
  uint32_t count = 0, first_angle = member == EULERS ? 0 : 3;
  if (status == TW_OK) status = api_json_array(json, &source->places[member], source->values[member], &count);
  if (status == TW_OK) status = check_row_count(source, member, count, track->key_count);
  if (status != TW_OK) return status;
  double *angles = tw_arena_alloc(json->arena, count, track->width * sizeof *angles);
  if (!angles) return api_json_no_memory(json);
  track->order = (tw_euler_order)order;
  track->angles = angles;
  api_place place = {&source->places[member], NULL, 0};
  for (const cJSON *item = source->values[member]->child; item; item = item->next, place.index++) {
    status = api_json_numbers(json, &place, item, track->width, angles);
    if (status != TW_OK) return status;
    for (uint32_t i = first_angle; unit == 1 && i < track->width; i++) angles[i] /= DEGREES;
    angles += track->width;
  }
  return TW_OK;
}

static tw_status read_keys(const track_source *source, tw_track_keys *track) {
  int member;
  tw_status status = find_keys(source, track, &member);
  if (status != TW_OK) return status;
  bool is_angles = member == EULERS || member == AXIS_ANGLES;
  if (source->values[ORDER] && member != EULERS)
    return fail_at(source, ORDER, TW_SYNTAX, "order is for eulers");
  if (source->values[UNIT] && !is_angles)
    return fail_at(source, UNIT, TW_SYNTAX, "unit is for eulers and axis_angles");
  track->width = member == EULERS || member == VALUES ? 3 : 4;
  track->form = member == EULERS        ? TW_KEY_EULER
                : member == AXIS_ANGLES ? TW_KEY_AXIS_ANGLE
                : member == QUATERNIONS ? TW_KEY_QUATERNION
                                        : TW_KEY_VALUES;
  status = read_times(source, track);
  if (status != TW_OK) return status;
  return is_angles ? read_angles(source, member, track) : read_values(source, member, track);
}

static tw_status read_track(const api_json *json, const api_place *at, const cJSON *item,
                            const api_names *nodes, tw_track_keys *out) {
  static const char *const paths[] = {"translation", "rotation", "scale", NULL};
  track_source source = {.json = json, .at = at};
  tw_status status = api_json_members(json, at, item, members, source.values);
  if (status != TW_OK) return status;
  for (int i = 0; i < MEMBERS; i++) source.places[i] = (api_place){at, members[i], 0};
  if (!source.values[NODE] || !source.values[PATH])
    return api_json_fail(json, at, TW_SYNTAX, "a track needs node and path");
  status = api_json_reference(json, &source.places[NODE], source.values[NODE], nodes, "node", &out->node);
  int path = TW_TRANSLATION;
  if (status == TW_OK)
    status = api_json_choice(json, &source.places[PATH], source.values[PATH], paths, &path);
  out->path = (tw_path)path;
  if (status == TW_OK) status = read_interpolation(&source, out);
  return status == TW_OK ? read_keys(&source, out) : status;
}

tw_status api_clip_from_json(const api_json *json, const api_place *at, const cJSON *item,
                             const api_names *nodes, tw_clip_keys *out) {
  static const char *const names[] = {"name", "tracks", NULL};
  const cJSON *values[2];
  tw_status status = api_json_members(json, at, item, names, values);
  if (status != TW_OK) return status;
  api_place name_place = {at, "name", 0}, tracks_place = {at, "tracks", 0};
  status = api_json_text(json, &name_place, values[0], &out->name);
  if (status == TW_OK) status = api_json_array(json, &tracks_place, values[1], &out->track_count);
  if (status != TW_OK) return status;
  tw_track_keys *tracks = tw_arena_alloc(json->arena, out->track_count, sizeof *tracks);
  if (!tracks) return api_json_no_memory(json);
  api_place place = {&tracks_place, NULL, 0};
  for (const cJSON *track = values[1] ? values[1]->child : NULL; track; track = track->next, place.index++) {
    status = read_track(json, &place, track, nodes, &tracks[place.index]);
    if (status != TW_OK) return status;
  }
  out->tracks = tracks;
  return TW_OK;
}
