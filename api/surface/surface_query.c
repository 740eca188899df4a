/* The table of a surface's parameters. The order of its rows is that of the keys. */
#include "surface_query.h"

#include <string.h>

#include "service.h"

/* ---- values of their own kind ---------------------------------------------------------------- */

static api_outcome read_level(api_call *call, const api_rule *rule, void *out) {
  const char *text = api_query_get(&call->query, rule->name);
  api_surface_query *query = out;
  query->auto_level.is_on = text && strcmp(text, "auto") == 0;
  if (!query->auto_level.is_on) return api_rule_read_count(call, rule, out);
  query->level = 0;
  return API_DONE;
}

/* Where meshes have levels of their own, prints all of them. */
static void print_level(const void *from, const api_rule *rule, tw_text *text) {
  const api_surface_query *query = from;
  const api_auto_level *chosen = &query->auto_level;
  bool differ = false;
  for (uint32_t i = 0; i < chosen->level_count; i++) differ |= chosen->levels[i] != query->level;
  api_rule_begin(rule->name, text);
  if (!differ) tw_text_count(text, query->level);
  for (uint32_t i = 0; i < chosen->level_count && differ; i++) {
    if (i > 0) tw_text_add(text, ",");
    tw_text_count(text, chosen->levels[i]);
  }
}

/* A distance, or a share of the model's size as "0.1%". */
static tw_status read_error_text(const char *text, api_auto_level *out, tw_error *error) {
  size_t length = text ? strlen(text) : 0;
  if (!text) return TW_OK;
  out->is_share = length > 0 && text[length - 1] == '%';
  if (!api_number_read(text, length - out->is_share, &out->error) || out->error < 1e-12 ||
      out->error > (double)TW_COORDINATE_MAX)
    return tw_fail(error, TW_SYNTAX, "error=%.60s: expected a distance over 1e-12, or a share as 0.1%%",
                   text);
  if (out->is_share) out->error /= 100;
  return TW_OK;
}

static api_outcome read_error(api_call *call, const api_rule *rule, void *out) {
  const char *text = api_query_get(&call->query, rule->name);
  return api_outcome_of(call,
                        read_error_text(text, &((api_surface_query *)out)->auto_level, &call->fault.error));
}

/* With neither, error=0.1% and faces=200000. */
static api_outcome read_faces(api_call *call, const api_rule *rule, void *out) {
  enum { DEFAULT_FACES = 200000 };
  api_auto_level *asked = &((api_surface_query *)out)->auto_level;
  tw_status status = api_query_count(&call->query, rule->name, &asked->faces, &call->fault.error);
  if (status == TW_OK && api_query_get(&call->query, rule->name) && asked->faces == 0)
    return api_fail_with(call, 400, "faces must be 1 or more");
  if (status == TW_OK && !asked->is_on && (asked->error > 0 || asked->faces > 0))
    return api_fail_with(call, 400, "error and faces go with level=auto");
  if (asked->is_on && asked->error == 0 && asked->faces == 0)
    *asked = (api_auto_level){.is_on = true, .error = 0.001, .is_share = true, .faces = DEFAULT_FACES};
  return api_outcome_of(call, status);
}

/* Prints what was asked for: answers tell of it. */
static void print_auto(const void *from, const api_rule *rule, tw_text *text) {
  const api_auto_level *asked = &((const api_surface_query *)from)->auto_level;
  if (!asked->is_on) return;
  api_rule_begin(rule->name, text);
  tw_text_double(text, asked->error);
  tw_text_add(text, asked->is_share ? "%/" : "/");
  tw_text_count(text, asked->faces);
}

static api_outcome read_quads(api_call *call, const api_rule *rule, void *out) {
  (void)rule;
  api_surface_query *query = out;
  return api_outcome_of(call, api_quads_read(&call->query, &query->reading.quads, &call->fault.error));
}

static void print_quads(const void *from, const api_rule *rule, tw_text *text) {
  api_rule_begin(rule->name, text);
  tw_text_integer(text, ((const api_surface_query *)from)->reading.quads);
}

/* Prints what level 0 keeps, too. */
static void print_normals(const void *from, const api_rule *rule, tw_text *text) {
  const api_surface_query *query = from;
  api_rule_begin(rule->name, text);
  tw_text_integer(text, query->normals != API_NORMALS_NONE);
  api_rule_begin("own", text);
  tw_text_integer(text, query->own_normals);
  api_rule_begin("tagged", text);
  tw_text_integer(text, query->tagged);
  api_rule_begin("holes", text);
  tw_text_integer(text, query->with_holes);
}

static api_outcome read_influences(api_call *call, const api_rule *rule, void *out) {
  int choice = 0;
  tw_status status = api_query_choice(&call->query, rule->name, rule->more, &choice, &call->fault.error);
  ((api_surface_query *)out)->influences = choice == 1 ? 4 : 0;
  return api_outcome_of(call, status);
}

/* A word, or a distance. */
static tw_status read_weld_text(const char *text, api_reading *out, tw_error *error) {
  double distance;
  if (!text || strcmp(text, "auto") == 0) return TW_OK;
  if (strcmp(text, "none") == 0 || strcmp(text, "exact") == 0) {
    out->weld = *text == 'n' ? TW_WELD_NONE : TW_WELD_EXACT;
    return TW_OK;
  }
  if (!api_number_read(text, strlen(text), &distance) || distance < 1e-9 ||
      distance > (double)TW_COORDINATE_MAX)
    return tw_fail(error, TW_SYNTAX, "weld=%.60s: expected auto, exact, none or a distance from 1e-9 to 1e18",
                   text);
  out->weld = TW_WELD_DISTANCE;
  out->distance = distance;
  return TW_OK;
}

static api_outcome read_weld(api_call *call, const api_rule *rule, void *out) {
  const char *text = api_query_get(&call->query, rule->name);
  return api_outcome_of(call, read_weld_text(text, &((api_surface_query *)out)->reading, &call->fault.error));
}

static void print_weld(const void *from, const api_rule *rule, tw_text *text) {
  const api_surface_query *query = from;
  api_rule_begin(rule->name, text);
  tw_text_integer(text, query->reading.weld);
  tw_text_add(text, "/");
  tw_text_double(text, query->reading.distance);
}

/* A word, or angle:DEGREES. */
static tw_status read_creases_text(const api_query *query, api_surface_query *out, tw_error *error) {
  static const char *const words[] = {"tags", "normals", "angle", "auto", "none", "file", NULL};
  static const char angle[] = "angle:";
  const char *text = api_query_get(query, "creases");
  int creases = TW_CREASES_FILE;
  if (text && strncmp(text, angle, strlen(angle)) == 0) {
    const char *degrees = text + strlen(angle);
    bool is_read = api_number_read(degrees, strlen(degrees), &out->crease_degrees);
    if (!is_read || out->crease_degrees < 0 || out->crease_degrees > 180)
      return tw_fail(error, TW_SYNTAX, "creases=%.60s: angle:DEGREES has a number from 0 to 180", text);
    creases = TW_CREASES_ANGLE;
  } else if (text && strcmp(text, "angle") == 0) {
    return tw_fail(error, TW_SYNTAX, "creases=angle needs degrees, as in creases=angle:30");
  } else {
    tw_status status = api_query_choice(query, "creases", words, &creases, error);
    if (status != TW_OK) return status;
  }
  out->creases = (tw_creases)creases;
  return TW_OK;
}

/* A number, or "infinite". */
static tw_status read_sharpness(const api_query *query, api_surface_query *out, tw_error *error) {
  const char *text = api_query_get(query, "crease_sharpness");
  double sharpness = (double)TW_SHARPNESS_INFINITE;
  bool is_number = text && strcmp(text, "infinite") != 0;
  tw_status status = is_number ? api_query_number(query, "crease_sharpness", &sharpness, error) : TW_OK;
  if (status != TW_OK) return status;
  if (sharpness < 0 || sharpness > (double)TW_SHARPNESS_INFINITE)
    return tw_fail(error, TW_SYNTAX, "crease_sharpness must be from 0 to 10, or infinite, which is 10");
  bool is_used = out->creases != TW_CREASES_TAGS && out->creases != TW_CREASES_NONE;
  out->crease_sharpness = is_used ? (float)sharpness : 0;
  return TW_OK;
}

static api_outcome read_creases(api_call *call, const api_rule *rule, void *out) {
  (void)rule;
  tw_status status = read_creases_text(&call->query, out, &call->fault.error);
  return api_outcome_of(call,
                        status == TW_OK ? read_sharpness(&call->query, out, &call->fault.error) : status);
}

static void print_creases(const void *from, const api_rule *rule, tw_text *text) {
  const api_surface_query *query = from;
  api_rule_begin(rule->name, text);
  tw_text_integer(text, query->creases);
  tw_text_add(text, "/");
  tw_text_double(text, query->crease_degrees);
  tw_text_add(text, "/");
  tw_text_double(text, (double)query->crease_sharpness);
}

/* For meshopt prints the codec's version, too, as another version may produce other bytes. */
static void print_encoding(const void *from, const api_rule *rule, tw_text *text) {
  api_rule_print_word(from, rule, text);
  if (((const api_surface_query *)from)->encoding == TW_ENCODING_MESHOPT)
    tw_text_integer(text, tw_meshopt_version());
}

static api_outcome read_clip(api_call *call, const api_rule *rule, void *out) {
  api_surface_query *query = out;
  query->clip = api_query_get(&call->query, rule->name);
  return api_clip_terms_read(call, false, &query->terms);
}

static void print_clips(const void *from, const api_rule *rule, tw_text *text) {
  (void)rule;
  api_rule_begin("clips", text);
  api_clips_print(&((const api_surface_query *)from)->choices, text);
}

static api_outcome read_times(api_call *call, const api_rule *rule, void *out) {
  (void)rule;
  return api_outcome_of(call, api_times_read(&call->query, call->service->limits.max_times, call->arena,
                                             &((api_surface_query *)out)->times, &call->fault.error));
}

static void print_times(const void *from, const api_rule *rule, tw_text *text) {
  (void)rule;
  const api_times *times = &((const api_surface_query *)from)->times;
  api_rule_begin("times", text);
  if (times->is_given) api_times_print(times, text);
}

static tw_status read_tolerances(const api_query *query, api_reduction *out, tw_error *error) {
  double degrees = 0.1, metres = 0.001;
  tw_status status = api_query_number(query, "tolerance", &degrees, error);
  if (status == TW_OK) status = api_query_number(query, "tolerance_m", &metres, error);
  if (status != TW_OK) return status;
  if (degrees < 0.0001 || degrees > 180)
    return tw_fail(error, TW_SYNTAX, "tolerance must be from 0.0001 to 180 degrees");
  if (metres < 1e-9) return tw_fail(error, TW_SYNTAX, "tolerance_m must be 1e-9 metres or more");
  out->tolerance = (tw_tolerance){degrees / TW_DEGREES, metres};
  out->is_wide = api_query_get(query, "tolerance") || api_query_get(query, "tolerance_m");
  return TW_OK;
}

static api_outcome read_tolerance(api_call *call, const api_rule *rule, void *out) {
  (void)rule;
  return api_outcome_of(
      call, read_tolerances(&call->query, &((api_surface_query *)out)->reduction, &call->fault.error));
}

static void print_tolerance(const void *from, const api_rule *rule, tw_text *text) {
  const api_reduction *reduction = &((const api_surface_query *)from)->reduction;
  if (!reduction->is_wide) return;
  api_rule_begin(rule->name, text);
  tw_text_double(text, reduction->tolerance.angle);
  tw_text_add(text, "/");
  tw_text_double(text, reduction->tolerance.distance);
}

static void print_shells(const void *from, const api_rule *rule, tw_text *text) {
  if (!((const api_surface_query *)from)->with_shells) return;
  tw_text_add(text, "&");
  tw_text_add(text, rule->name);
}

static api_outcome read_mesh(api_call *call, const api_rule *rule, void *out) {
  ((api_surface_query *)out)->mesh = api_query_get(&call->query, rule->name);
  return API_DONE;
}

static void print_mesh(const void *from, const api_rule *rule, tw_text *text) {
  const api_surface_query *query = from;
  if (!query->mesh) return;
  api_rule_begin(rule->name, text);
  tw_text_string(text, query->mesh);
}

/* The unit's default is the form's, see api_surface_query_complete. */
static void print_unit(const void *from, const api_rule *rule, tw_text *text) {
  (void)rule;
  api_flat_print(&((const api_surface_query *)from)->flat, text);
}

/* ---- the table ------------------------------------------------------------------------------- */

#define AT(member) offsetof(api_surface_query, member)

enum {
  SURFACE = API_KEY_PLAN | API_KEY_PACKS | API_KEY_ANSWER,
  SHAPE = SURFACE | API_KEY_ERRORS,
  WRITTEN = API_KEY_PACKS | API_KEY_ANSWER,
  MOVING = API_KEY_REDUCED | API_KEY_ANSWER,
  SHOWN = API_KEY_ANSWER
};

static const char *const schemes[] = {"catmull-clark", "loop", "bilinear", NULL};
static const char *const boundaries[] = {"edge-and-corner", "edge-only", "none", "open", NULL};
static const char *const uvs[] = {"corners-only", "none", "corners-plus1", "corners-plus2", "boundaries",
                                  "all",          NULL};
static const char *const creasings[] = {"uniform", "chaikin", NULL};
static const char *const triangles[] = {"catmull-clark", "smooth", NULL};
static const char *const normals[] = {"auto", "limit", "none", NULL};
static const char *const influences[] = {"all", "4", NULL};
static const char *const polygons[] = {"triangles", "ngon", NULL};
static const char *const encodings[] = {"float", "quantized", "meshopt", NULL};
/* Their numbers are the bits of API_WITH_*. */
static const char *const withs[] = {"positions", "normals", "uvs", "normals,uvs", NULL};
static const char *const meshes[] = {"all", "none", NULL};
static const char *const skins[] = {"keep", "bake", NULL};

const api_rule api_levels_rules[] = {
    {"scheme", SHAPE, AT(scheme), schemes, api_rule_read_choice, api_rule_print_choice},
    {"boundary", SHAPE, AT(boundary), boundaries, api_rule_read_choice, api_rule_print_choice},
    {"uv", SHAPE, AT(uv), uvs, api_rule_read_choice, api_rule_print_choice},
    {"creasing", SHAPE, AT(creasing), creasings, api_rule_read_choice, api_rule_print_choice},
    {"triangles", SHAPE, AT(triangles), triangles, api_rule_read_choice, api_rule_print_choice},
    {"quads", SHAPE, 0, NULL, read_quads, print_quads},
    {"limit", SHAPE, AT(limit), NULL, api_rule_read_flag, api_rule_print_flag},
    {"normals", SURFACE, AT(normals), normals, api_rule_read_choice, print_normals},
    {"details", SHAPE, AT(details), NULL, api_rule_read_flag, api_rule_print_flag},
    {"influences", SURFACE, AT(influences), influences, read_influences, api_rule_print_choice},
    {"weld", SHAPE, 0, NULL, read_weld, print_weld},
    {"creases", SHAPE, 0, NULL, read_creases, print_creases}, /* and crease_sharpness */
    {.name = "crease_sharpness"},
    {"polygons", WRITTEN, AT(polygons), polygons, api_rule_read_choice, api_rule_print_word},
    {"encoding", WRITTEN, AT(encoding), encodings, api_rule_read_choice, print_encoding},
    {"meshes", SHOWN, AT(meshes), meshes, api_rule_read_choice, api_rule_print_word},
    {"skin", WRITTEN, AT(skin), skins, api_rule_read_choice, api_rule_print_word},
    {"clip", MOVING, 0, NULL, read_clip, print_clips}, /* and its terms */
    {"at", SHOWN, 0, NULL, read_times, print_times},   /* and from, to, fps */
    {.name = "from"},
    {.name = "to"},
    {.name = "fps"},
    {"tolerance", MOVING, 0, NULL, read_tolerance, print_tolerance}, /* and tolerance_m */
    {.name = "tolerance_m"},
    {.name = "download"}, /* read by file_name.c */
    {.more = api_clip_term_rules}};

const api_rule api_surface_rules[] = {
    {"level", SURFACE, AT(level), NULL, read_level, print_level},
    {"error", SHOWN, 0, NULL, read_error, print_auto}, /* and faces */
    {.name = "faces", .read = read_faces},
    {"unit", SHOWN, 0, NULL, NULL, print_unit}, /* and scale */
    {.name = "scale"},
    {"shells", SHOWN, AT(with_shells), NULL, api_rule_read_flag, print_shells},
    {"mesh", SHOWN, 0, NULL, read_mesh, print_mesh},
    {"with", SHOWN, AT(with), withs, api_rule_read_choice, api_rule_print_word},
    {.more = api_levels_rules}};

api_outcome api_surface_query_read(api_call *call, api_surface_query *out) {
  *out = (api_surface_query){.level = 1,
                             .boundary = -1,
                             .uv = -1,
                             .creasing = -1,
                             .triangles = -1,
                             .details = true,
                             .creases = TW_CREASES_FILE,
                             .crease_sharpness = TW_SHARPNESS_INFINITE};
  api_outcome outcome = api_rules_read(call, api_surface_rules, out);
  /* Loop's scheme refuses pairs of triangles: nobody who asks for it means them to be joined. */
  if (out->scheme == TW_LOOP && out->reading.quads == TW_QUADS_USUAL) out->reading.quads = TW_QUADS_NGON;
  return outcome;
}

const char *api_surface_key_print(api_call *call, const api_surface_query *query, api_surface_key key,
                                  const char *head) {
  tw_text text = {0};
  if (head) tw_text_add(&text, call->id);
  if (head) tw_text_add(&text, head);
  api_rules_print(query, api_surface_rules, key, &text);
  if ((key & API_KEY_ANSWER) && query->idle) { /* which the answer tells of */
    api_rule_begin("idle", &text);
    tw_text_add(&text, query->idle);
  }
  return api_text_move(&text, call->arena);
}

/* ---- what they make of each other ------------------------------------------------------------ */

/* The parameter that asks for motion. */
static const char *find_moving(const api_call *call, const api_surface_query *query) {
  static const char *const names[] = {"at", "from", "to", "fps", "tolerance", "tolerance_m"};
  size_t i = 0;
  if (query->clip && strcmp(query->clip, "none") != 0) return "clip";
  while (i + 1 < sizeof names / sizeof *names && !api_query_get(&call->query, names[i])) i++;
  return names[i];
}

/* Whether parameters ask for clips or times. */
static bool asks_for_motion(const api_surface_query *query) {
  bool keeps_clip = query->clip && strcmp(query->clip, "none") != 0;
  return keeps_clip || query->times.is_given || query->reduction.is_wide;
}

bool api_surface_has_still(const api_surface_query *query) {
  return query->meshes != API_MESHES_NONE && (api_is_moment(query) || !asks_for_motion(query));
}

/* Checks the parameters for a form of meshes alone: no animations, and meshes must not be left out. Such a
 * form has neither joints nor targets: it shows the points where these put them. */
static tw_status take_meshes_alone(api_call *call, api_surface_query *query, const char *form) {
  tw_error *error = &call->fault.error;
  if (query->meshes == API_MESHES_NONE)
    return tw_fail(error, TW_SYNTAX, "meshes=none leaves nothing of an answer as %s", form);
  if (!api_surface_has_still(query))
    return tw_fail(error, TW_SYNTAX,
                   "%s: %s holds no clip: at=T shows the model at one time, .glb has animations",
                   find_moving(call, query), form);
  query->skin = API_SKIN_BAKE;
  if (!query->times.is_given) query->clip = "none";
  return TW_OK;
}

/* Checks the parameters for the points of one mesh, which nothing poses. */
static tw_status take_points_alone(api_call *call, api_surface_query *query) {
  tw_error *error = &call->fault.error;
  const char *wrong = query->meshes == API_MESHES_NONE ? "meshes=none"
                      : query->skin == API_SKIN_BAKE   ? "skin=bake"
                                                       : find_moving(call, query);
  if (!query->has_points)
    return tw_fail(error, TW_SYNTAX,
                   "%s: .bin has the points of a mesh by itself: no clip, time, skin=bake or meshes=none",
                   wrong);
  if ((query->with & API_WITH_NORMALS) && query->normals == API_NORMALS_NONE)
    return tw_fail(error, TW_SYNTAX, "with=normals contradicts normals=none");
  query->clip = "none";
  return TW_OK;
}

/* Checks parameters that need or exclude another one. */
static tw_status check_together(const api_surface_query *query, tw_error *error) {
  bool has_no_clip = query->clip && strcmp(query->clip, "none") == 0, is_baked = query->skin == API_SKIN_BAKE;
  if (is_baked && !api_is_moment(query) && !(api_is_baked_at_rest(query) && has_no_clip))
    return tw_fail(error, TW_SYNTAX,
                   "skin=bake goes with one time, at=T, or without times with clip=none: at rest");
  if (is_baked && query->meshes == API_MESHES_NONE)
    return tw_fail(error, TW_SYNTAX, "meshes=none leaves skin=bake nothing to move");
  if (query->reduction.is_wide && query->times.is_given)
    return tw_fail(error, TW_SYNTAX, "tolerance has no place with times, which say where the keys are");
  return TW_OK;
}

/* Whether a parameter asks for what the form does not do. */
static bool is_idle(const api_query *query, const api_idle *idle, bool is_timed) {
  const char *value = api_query_get(query, idle->name),
             *other = idle->unless ? api_query_get(query, idle->unless) : NULL;
  if (!value || (idle->own && strcmp(value, idle->own) == 0)) return false;
  if (idle->is_of_clips && is_timed) return false;
  return !other || !strstr(other, idle->says);
}

static void list_idle(const api_call *call, const api_idle *idle, bool is_timed, tw_text *text) {
  for (; idle && idle->name; idle++) {
    if (!is_idle(&call->query, idle, is_timed)) continue;
    tw_text_add(text, text->size > 0 ? ", " : "");
    tw_text_add(text, idle->name);
    tw_text_add(text, "=");
    tw_text_add(text, api_query_get(&call->query, idle->name));
  }
}

/* Lists the parameters that the form has no use for, as they were given. */
static api_outcome find_idle(api_call *call, const api_surface_form *form, api_surface_query *query) {
  static const api_idle of_gltf_alone[] = {{.name = "encoding", .own = "float"},
                                           {.name = "influences", .own = "all"},
                                           {.name = "retarget", .own = "none", .is_of_clips = true},
                                           {.name = "root_motion", .is_of_clips = true},
                                           {.name = "in_place", .own = "false", .is_of_clips = true},
                                           {0}};
  tw_text text = {0};
  if (!form->is_gltf) list_idle(call, of_gltf_alone, query->times.is_given, &text);
  list_idle(call, form->idle, query->times.is_given, &text);
  if (text.size == 0 && !text.failed) return API_DONE;
  query->idle = api_text_move(&text, call->arena);
  return query->idle ? API_DONE : api_fail_without_memory(call);
}

/* Whether a mesh has level 0. */
static bool shows_cage(const api_surface_query *query) {
  bool has = query->level == 0;
  for (uint32_t i = 0; i < query->auto_level.level_count; i++) has |= query->auto_level.levels[i] == 0;
  return has;
}

/* Level 0 in a form that can express all of a cage reads back as the cage. */
void api_surface_query_keep_cage(const api_surface_form *form, api_surface_query *query) {
  bool is_at_rest = query->level == 0 && !query->limit;
  bool is_cage_of_gltf =
      form->is_gltf && query->polygons == TW_POLYGONS_NGON && query->encoding == TW_ENCODING_FLOAT;
  query->tagged = is_at_rest && (form->has_tags || is_cage_of_gltf);
  query->with_holes = query->tagged && is_cage_of_gltf;
  query->own_normals = !query->limit && query->normals == API_NORMALS_AUTO && shows_cage(query);
}

api_outcome api_surface_query_fix_level(api_call *call, const api_surface_query *query) {
  if (!query->auto_level.is_on) return API_DONE;
  return api_fail_with(call, 400, "level=auto goes with answers of surfaces: here the level is a number");
}

/* A moment shows the root motion where that is not dropped; animations carry it. */
static void carry_root(api_surface_query *query) {
  api_root *root = &query->terms.root;
  if (api_is_moment(query) && !root->in_place) root->is_on = false;
  root->is_carried = root->is_on && !root->in_place;
}

api_outcome api_surface_query_complete(api_call *call, const api_surface_form *form,
                                       api_surface_query *query) {
  tw_error *error = &call->fault.error;
  api_surface_query_keep_cage(form, query);
  query->has_points =
      query->meshes != API_MESHES_NONE && query->skin != API_SKIN_BAKE && !asks_for_motion(query);
  if (!form->is_gltf) query->encoding = TW_ENCODING_FLOAT;
  tw_status status = TW_OK;
  if (form->still) status = take_meshes_alone(call, query, form->still);
  if (form->is_counts && query->with_shells) status = take_meshes_alone(call, query, "shells=true");
  if (form->is_points) status = take_points_alone(call, query);
  if (status == TW_OK) status = check_together(query, error);
  if (status != TW_OK) return api_fail(call);
  carry_root(query);
  if (api_flat_read(call, form->unit, &query->flat) != API_DONE) return API_FAILED;
  if (!form->is_counts && query->with_shells)
    return api_fail_with(call, 400, "shells=true goes with .json: it tells of the shells of the other forms");
  if (!form->is_points && (query->mesh || query->with))
    return api_fail_with(call, 400, "mesh and with go with .bin, the points of one mesh");
  return find_idle(call, form, query);
}
