/* Clips of tweend JSON. */
#include "clips_in.h"

#include <string.h>

#include "api.h"
#include "tweend/mix.h"

/* ---- tracks ---------------------------------------------------------------------------------- */

enum {
  TRACK_NODE,
  TRACK_PATH,
  TRACK_INTERPOLATION,
  TRACK_ORDER,
  TRACK_UNIT,
  TRACK_TIMES,
  TRACK_QUATERNIONS,
  TRACK_EULERS,
  TRACK_AXIS_ANGLES,
  TRACK_VALUES,
  TRACK_IN_TANGENTS,
  TRACK_OUT_TANGENTS,
  TRACK_MEMBERS
};
static const char *const track_members[] = {
    "node",   "path",        "interpolation", "order",       "unit",         "times", "quaternions",
    "eulers", "axis_angles", "values",        "in_tangents", "out_tangents", NULL};

/* values here and below: [TRACK_MEMBERS] */
static tw_status read_interpolation(const api_value *values, tw_track_keys *track) {
  /* "slerp" is another word for glTF's LINEAR. */
  enum { SLERP = TW_EULER + 1 };
  static const char *const choices[] = {"step",  "linear", "cubicspline", "nlerp",
                                        "squad", "euler",  "slerp",       NULL};
  int choice = TW_LINEAR;
  tw_status status = api_json_choice(&values[TRACK_INTERPOLATION], choices, &choice);
  if (status != TW_OK) return status;
  bool for_all = choice == TW_STEP || choice == TW_LINEAR || choice == TW_CUBICSPLINE;
  if (track->path != TW_ROTATION && !for_all)
    return api_json_fail(&values[TRACK_INTERPOLATION], TW_INVALID, "this interpolation is for rotations");
  track->interpolation = choice == SLERP ? TW_LINEAR : (tw_interpolation)choice;
  return TW_OK;
}

/* Finds the one member that holds the keys. */
static tw_status find_keys(const api_value *object, const api_value *values, const tw_track_keys *track,
                           int *member) {
  static const int forms[] = {TRACK_QUATERNIONS, TRACK_EULERS, TRACK_AXIS_ANGLES, TRACK_VALUES};
  *member = -1;
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    if (!values[forms[i]].item) continue;
    if (*member >= 0)
      return api_json_fail(&values[forms[i]], TW_SYNTAX, "the keys are given as %s already",
                           track_members[*member]);
    *member = forms[i];
  }
  bool is_rotation = track->path == TW_ROTATION;
  if (*member < 0)
    return api_json_fail(object, TW_SYNTAX, "the track has no %s",
                         is_rotation ? "quaternions, eulers or axis_angles" : "values");
  if (is_rotation == (*member == TRACK_VALUES))
    return api_json_fail(&values[*member], TW_SYNTAX,
                         is_rotation ? "a rotation's keys are quaternions, eulers or axis_angles"
                                     : "only rotations have such keys");
  return TW_OK;
}

static tw_status read_times(const api_value *object, const api_value *array, tw_track_keys *track) {
  if (!array->item) return api_json_fail(object, TW_SYNTAX, "the track has no times");
  tw_status status = api_json_count(array, UINT32_MAX, &track->key_count);
  if (status != TW_OK) return status;
  if (track->key_count == 0) return api_json_fail(array, TW_INVALID, "a track needs a key");
  float *times = api_json_allocate(array->json, track->key_count, sizeof *times, &status);
  track->times = times;
  return times ? api_json_float_list(array, times) : status;
}

/* Checks that the array is there, with a row for each key. */
static tw_status check_rows(const api_value *object, const api_value *array, const tw_track_keys *track) {
  uint32_t count;
  if (!array->item) return api_json_fail(object, TW_SYNTAX, "the track has no %s", array->at.name);
  tw_status status = api_json_count(array, UINT32_MAX, &count);
  if (status != TW_OK || count == track->key_count) return status;
  return api_json_fail(array, TW_INVALID, "%u %s for %u %s", count, tw_plural(count, "key", "keys"),
                       track->key_count, tw_plural(track->key_count, "time", "times"));
}

/* Reads values, or quaternions; with tangents interleaved as in glTF: in-tangent, value, out-tangent. */
static tw_status read_values(const api_value *object, const api_value *values, int member,
                             tw_track_keys *track) {
  const api_value *const parts[] = {&values[TRACK_IN_TANGENTS], &values[member], &values[TRACK_OUT_TANGENTS]};
  bool is_spline = track->interpolation == TW_CUBICSPLINE;
  for (int i = 0; i < 3; i += 2)
    if (!is_spline && parts[i]->item)
      return api_json_fail(parts[i], TW_SYNTAX, "tangents are for cubicspline");
  size_t first = is_spline ? 0 : 1, count = is_spline ? 3 : 1, stride = count * track->width;
  tw_status status = TW_OK;
  for (size_t i = 0; i < count && status == TW_OK; i++) status = check_rows(object, parts[first + i], track);
  float *out = api_json_allocate(object->json, track->key_count, stride * sizeof *out, &status);
  for (size_t i = 0; i < count && status == TW_OK; i++)
    status = api_json_float_rows(parts[first + i], track->width, stride, out + i * track->width);
  track->values = out;
  return status;
}

/* Reads Euler triples or axis-angle keys, into radians. */
static tw_status read_angles(const api_value *object, const api_value *values, int member,
                             tw_track_keys *track) {
  static const char *const units[] = {"radians", "degrees", NULL};
  int order = TW_XYZ, unit = 0;
  tw_status status = api_json_choice(&values[TRACK_ORDER], tw_euler_order_names, &order);
  if (status == TW_OK) status = api_json_choice(&values[TRACK_UNIT], units, &unit);
  if (status == TW_OK) status = check_rows(object, &values[member], track);
  double *angles = api_json_allocate(object->json, track->key_count, track->width * sizeof *angles, &status);
  if (status == TW_OK) status = api_json_double_rows(&values[member], track->width, angles);
  if (status != TW_OK) return status;
  size_t first_angle = member == TRACK_EULERS ? 0 : 3;
  for (size_t i = 0; unit == 1 && i < (size_t)track->key_count * track->width; i++)
    if (i % track->width >= first_angle) angles[i] /= TW_DEGREES;
  track->order = (tw_euler_order)order;
  track->angles = angles;
  return TW_OK;
}

static tw_status read_keys(const api_value *object, const api_value *values, tw_track_keys *track) {
  int member;
  tw_status status = find_keys(object, values, track, &member);
  if (status != TW_OK) return status;
  bool is_angles = member == TRACK_EULERS || member == TRACK_AXIS_ANGLES;
  if (values[TRACK_ORDER].item && member != TRACK_EULERS)
    return api_json_fail(&values[TRACK_ORDER], TW_SYNTAX, "order is for eulers");
  if (values[TRACK_UNIT].item && !is_angles)
    return api_json_fail(&values[TRACK_UNIT], TW_SYNTAX, "unit is for eulers and axis_angles");
  track->width = member == TRACK_EULERS || member == TRACK_VALUES ? 3 : 4;
  track->form = member == TRACK_EULERS        ? TW_KEY_EULER
                : member == TRACK_AXIS_ANGLES ? TW_KEY_AXIS_ANGLE
                : member == TRACK_QUATERNIONS ? TW_KEY_QUATERNION
                                              : TW_KEY_VALUES;
  status = read_times(object, &values[TRACK_TIMES], track);
  if (status != TW_OK) return status;
  return is_angles ? read_angles(object, values, member, track) : read_values(object, values, member, track);
}

/* What reading the tracks of a clip needs. */
typedef struct track_reader {
  const api_names *nodes;
  tw_track_keys *tracks;
} track_reader;

static tw_status read_track(void *context, const api_value *object) {
  static const char *const paths[] = {"translation", "rotation", "scale", NULL};
  const track_reader *reader = context;
  tw_track_keys *track = &reader->tracks[object->at.index];
  api_value values[TRACK_MEMBERS];
  tw_status status = api_json_members(object, track_members, values);
  if (status != TW_OK) return status;
  if (!values[TRACK_NODE].item || !values[TRACK_PATH].item)
    return api_json_fail(object, TW_SYNTAX, "a track needs node and path");
  status = api_name_find(&values[TRACK_NODE], reader->nodes, &track->node);
  int path = TW_TRANSLATION;
  if (status == TW_OK) status = api_json_choice(&values[TRACK_PATH], paths, &path);
  track->path = (tw_path)path;
  if (status == TW_OK) status = read_interpolation(values, track);
  return status == TW_OK ? read_keys(object, values, track) : status;
}

/* ---- layers of mixed clips ------------------------------------------------------------------- */

enum {
  LAYER_CLIP,
  LAYER_MODE,
  LAYER_WEIGHT,
  LAYER_SPEED,
  LAYER_OFFSET,
  LAYER_LOOP,
  LAYER_SYNC,
  LAYER_NODES,
  LAYER_REFERENCE,
  LAYER_RETARGET,
  LAYER_MAP,
  LAYER_FEET,
  LAYER_MEMBERS
};
static const char *const layer_members[] = {"clip", "mode", "weight", "speed",     "offset",
                                            "loop", "sync", "nodes",  "reference", "retarget",
                                            "map",  "feet", NULL};

/* What reading the layers of a clip needs. */
typedef struct layer_reader {
  const api_names *nodes, *clips;
  tw_clip_layer *layers;
} layer_reader;

bool api_clip_is_borrowed(const char *name, size_t length) {
  enum { ID = API_ID_TEXT - 1 };
  return length > ID + 1 && strspn(name, "0123456789abcdef") == ID && name[ID] == '/';
}

/* Reads the name of a clip: one of the document, or "{model id}/{name}". */
static tw_status read_layer_clip(const layer_reader *reader, const api_value *object, const api_value *value,
                                 tw_clip_layer *layer) {
  if (!value->item) return api_json_fail(object, TW_SYNTAX, "a layer needs a clip");
  tw_status status = api_json_text(value, &layer->clip);
  if (status != TW_OK) return status;
  layer->own = TW_NO_INDEX;
  size_t length = strlen(layer->clip);
  if (length > TW_NAME_MAX + API_ID_TEXT)
    return api_json_fail(value, TW_LIMIT, "a name has at most %d bytes", TW_NAME_MAX);
  status = api_name_find(value, reader->clips, &layer->own);
  if (status == TW_OK || !api_clip_is_borrowed(layer->clip, length)) return status;
  layer->own = TW_NO_INDEX;
  return TW_OK;
}

static tw_status read_weight_keys(void *context, const api_value *object) {
  static const char *const members[] = {"times", "values", NULL};
  tw_layer *layer = context;
  api_value values[2];
  uint32_t count = 0;
  tw_status status = api_json_members(object, members, values);
  if (status == TW_OK) status = api_json_count(&values[0], TW_LAYER_KEYS_MAX, &layer->weight_count);
  if (status == TW_OK) status = api_json_count(&values[1], TW_LAYER_KEYS_MAX, &count);
  if (status != TW_OK) return status;
  if (layer->weight_count == 0) return api_json_fail(object, TW_SYNTAX, "a keyed weight needs times");
  if (count != layer->weight_count)
    return api_json_fail(&values[1], TW_INVALID, "%u %s for %u %s", count,
                         tw_plural(count, "value", "values"), layer->weight_count,
                         tw_plural(layer->weight_count, "time", "times"));
  float *times = api_json_allocate(object->json, count, sizeof *times, &status);
  float *weights = api_json_allocate(object->json, count, sizeof *weights, &status);
  if (status == TW_OK) status = api_json_float_list(&values[0], times);
  if (status == TW_OK) status = api_json_float_list(&values[1], weights);
  layer->weight_times = times;
  layer->weights = weights;
  return status;
}

/* Reads a number, or times and values. */
static tw_status read_weight(const api_value *value, tw_layer *layer) {
  static const float usual = 1;
  tw_status status = TW_OK;
  layer->weight_count = 1;
  layer->weights = &usual;
  if (!value->item) return TW_OK;
  if (cJSON_IsObject(value->item)) return api_json_object(value, read_weight_keys, layer);
  if (!cJSON_IsNumber(value->item))
    return api_json_fail(value, TW_SYNTAX, "a weight is a number, or {\"times\": [], \"values\": []}");
  float *weight = api_json_allocate(value->json, 1, sizeof *weight, &status);
  layer->weights = weight;
  return weight ? api_json_float(value, weight) : status;
}

/* Reads when the layer plays. */
static tw_status read_layer_times(const api_value *values, tw_layer *layer) {
  static const char *const loops[] = {"clamp", "repeat", "pingpong", NULL};
  int loop = TW_CLAMP;
  layer->speed = 1;
  tw_status status = api_json_double(&values[LAYER_SPEED], &layer->speed);
  if (status == TW_OK) status = api_json_double(&values[LAYER_OFFSET], &layer->offset);
  if (status == TW_OK) status = api_json_choice(&values[LAYER_LOOP], loops, &loop);
  if (status == TW_OK && values[LAYER_SYNC].item)
    status = api_json_flag(&values[LAYER_SYNC], &layer->is_synced);
  layer->loop = (tw_loop)loop;
  if (status == TW_OK && layer->is_synced && values[LAYER_LOOP].item)
    return api_json_fail(&values[LAYER_LOOP], TW_SYNTAX, "a layer with sync repeats: loop has no place");
  return status;
}

typedef struct mask_reader {
  const api_names *nodes;
  uint32_t *out;
} mask_reader;

static tw_status read_mask_node(void *context, const api_value *text) {
  const mask_reader *reader = context;
  return api_name_find(text, reader->nodes, &reader->out[text->at.index]);
}

static tw_status read_mask(const api_value *array, const api_names *nodes, tw_clip_layer *layer) {
  if (!array->item) return TW_OK;
  tw_status status = api_json_count(array, TW_LAYER_NODES_MAX, &layer->node_count);
  if (status == TW_OK && layer->node_count == 0)
    return api_json_fail(array, TW_INVALID, "a layer without nodes moves nothing");
  uint32_t *out = api_json_allocate(array->json, layer->node_count, sizeof *out, &status);
  layer->nodes = out;
  return out ? api_json_each_text(array, read_mask_node, &(mask_reader){nodes, out}) : status;
}

/* Reads how the clip of another model is carried over. */
static tw_status read_retarget(const api_value *values, tw_clip_layer *layer) {
  static const char *const ways[] = {"none", "auto", NULL}, *const feet[] = {"hold", NULL};
  int way = 0, hold = 0;
  tw_status status = api_json_choice(&values[LAYER_RETARGET], ways, &way);
  if (status == TW_OK && values[LAYER_MAP].item)
    status = api_json_object(&values[LAYER_MAP], api_bone_map_read, &layer->retarget);
  if (status == TW_OK) status = api_json_choice(&values[LAYER_FEET], feet, &hold);
  layer->retarget.is_auto = way == 1;
  layer->retarget.holds_feet = values[LAYER_FEET].item != NULL;
  if (status != TW_OK) return status;
  for (int i = LAYER_MAP; i <= LAYER_FEET; i++)
    if (values[i].item && !layer->retarget.is_auto)
      return api_json_fail(&values[i], TW_SYNTAX, "%s goes with retarget auto", layer_members[i]);
  if (layer->retarget.is_auto && layer->own != TW_NO_INDEX)
    return api_json_fail(&values[LAYER_RETARGET], TW_SYNTAX, "retarget goes with clips of other models");
  return TW_OK;
}

static tw_status read_layer(void *context, const api_value *object) {
  static const char *const modes[] = {"replace", "additive", NULL};
  const layer_reader *reader = context;
  tw_clip_layer *layer = &reader->layers[object->at.index];
  api_value values[LAYER_MEMBERS];
  int mode = TW_LAYER_REPLACE;
  tw_status status = api_json_members(object, layer_members, values);
  if (status == TW_OK) status = read_layer_clip(reader, object, &values[LAYER_CLIP], layer);
  if (status == TW_OK) status = api_json_choice(&values[LAYER_MODE], modes, &mode);
  if (status == TW_OK) status = read_weight(&values[LAYER_WEIGHT], &layer->layer);
  if (status == TW_OK) status = read_layer_times(values, &layer->layer);
  if (status == TW_OK) status = read_mask(&values[LAYER_NODES], reader->nodes, layer);
  if (status == TW_OK) status = api_json_double(&values[LAYER_REFERENCE], &layer->layer.reference);
  if (status == TW_OK) status = read_retarget(values, layer);
  layer->layer.mode = (tw_layer_mode)mode;
  if (status == TW_OK && values[LAYER_REFERENCE].item && mode != TW_LAYER_ADDITIVE)
    return api_json_fail(&values[LAYER_REFERENCE], TW_SYNTAX, "reference is for mode additive");
  return status;
}

static tw_status read_layers(const api_clips_reader *reader, const api_value *array, tw_clip_keys *clip) {
  tw_status status = api_json_count(array, TW_LAYERS_MAX, &clip->layer_count);
  if (status == TW_OK && clip->layer_count == 0)
    return api_json_fail(array, TW_INVALID, "a mixed clip needs a layer");
  tw_clip_layer *layers =
      status == TW_OK ? tw_arena_alloc(array->json->arena, clip->layer_count, sizeof *layers) : NULL;
  if (status == TW_OK && !layers) return api_json_no_memory(array->json);
  clip->layers = layers;
  return status == TW_OK
             ? api_json_each(array, read_layer, &(layer_reader){reader->nodes, reader->clips, layers})
             : status;
}

/* ---- clips ----------------------------------------------------------------------------------- */

tw_status api_clip_in(void *context, const api_value *object) {
  enum { NAME, TRACKS, LAYERS, MEMBERS };
  static const char *const members[] = {"name", "tracks", "layers", NULL};
  api_clips_reader *reader = context;
  tw_clip_keys *clip = &reader->model->clips[object->at.index];
  api_value values[MEMBERS];
  tw_status status = api_json_members(object, members, values);
  if (status == TW_OK) status = api_json_name(&values[NAME], &clip->name);
  if (status == TW_OK && values[TRACKS].item && values[LAYERS].item)
    return api_json_fail(&values[LAYERS], TW_SYNTAX, "a clip has tracks or layers, not both");
  if (status == TW_OK)
    status = api_json_count(&values[TRACKS], TW_TRACKS_MAX - reader->track_count, &clip->track_count);
  if (status != TW_OK) return status;
  if (values[LAYERS].item) return read_layers(reader, &values[LAYERS], clip);
  reader->track_count += clip->track_count;
  tw_track_keys *tracks = tw_arena_alloc(object->json->arena, clip->track_count, sizeof *tracks);
  if (!tracks) return api_json_no_memory(object->json);
  clip->tracks = tracks;
  return api_json_each(&values[TRACKS], read_track, &(track_reader){reader->nodes, tracks});
}
