/* Sends requests one after the other to a service with little memory, each byte of the input a choice among
 * models, ways to change them and ways to ask for them. Whatever came before, an answer must be a pure
 * function of its URL: the same bytes and entity tag every time, 304 to that tag, and the same header fields
 * to HEAD. Nothing may stay granted, and nothing may fail with 500. */
#include "loopback.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum { MODELS_MAX = 24, ANSWERS_MAX = 16, TARGET_MAX = 512, STEPS_MAX = 60 };

/* What a GET of a target was answered with. */
typedef struct answered {
  char target[TARGET_MAX], tag[128];
  uint64_t hash;
  int status;
  bool is_partial; /* no-cache: it lacks clips of models that are absent */
  bool is_named;   /* a description, which has the name of the upload */
} answered;

typedef struct sequence {
  loopback *loop;
  const uint8_t *at, *end;           /* choices that are left */
  char ids[MODELS_MAX][API_ID_TEXT]; /* of models that were made, and may be deleted since */
  size_t models;                     /* made so far, the last MODELS_MAX of which are in ids */
  answered answers[ANSWERS_MAX];     /* the last ones */
  size_t count;
} sequence;

static void give_up(const char *format, ...) {
  va_list list;
  va_start(list, format);
  vfprintf(stderr, format, list);
  va_end(list);
  fputc('\n', stderr);
  abort();
}

/* ---- choices --------------------------------------------------------------------------------- */

#define COUNT(table)            (sizeof(table) / sizeof *(table))
#define CHOOSE(sequence, table) (table)[choose(sequence, COUNT(table))]

/* The next byte of the input as a number below `count`; 0 behind the end of the input. */
static size_t choose(sequence *s, size_t count) {
  return s->at < s->end ? *s->at++ % count : 0;
}

static const char *choose_model(sequence *s) {
  size_t held = s->models < MODELS_MAX ? s->models : MODELS_MAX;
  return held > 0 ? s->ids[choose(s, held)] : "00000000000000000000000000000000";
}

/* ---- models and changes ---------------------------------------------------------------------- */

/* With ' in place of ". %u: makes one model of several. {}: the id of a model. */
static const char *const documents[] = {
    "{'meshes':[{'name':'m','shape':{'kind':'box','size':[1,2,1%u]}}]}",
    "{'meshes':[{'name':'m','positions':[[0,0,0],[1,0,0],[1,1,0.%u],[0,1,0],[2,0,1]],'faces':[[0,1,2,3],[1,4,"
    "2]],"
    "'creases':[{'edge':[1,2],'sharpness':1.5}],'uvs':[[0,0],[1,0],[1,1],[0,1],[2,0]]}],"
    "'nodes':[{'name':'hips','mesh':'m'},{'name':'spine','parent':'hips','translation':[0,1,0]}],"
    "'clips':[{'name':'c','tracks':["
    "{'node':'hips','path':'rotation','times':[0,1],'quaternions':[[0,0,0,1],[0,0.6,0,0.8]]},"
    "{'node':'spine','path':'translation','times':[0,2],'values':[[0,1,0],[0,2,0]]}]}]}",
    "{'nodes':[{'name':'Hips','translation':[0,1,0]},{'name':'Spine','parent':'Hips','translation':[0,0.5,0]}"
    "],"
    "'clips':[{'name':'c','tracks':["
    "{'node':'Spine','path':'rotation','unit':'degrees','times':[0,1.%u],'eulers':[[0,0,0],[90,0,30]]}]},"
    "{'name':'x','layers':[{'clip':'c'},{'clip':'c','mode':'additive','weight':0.5}]}]}",
    "o t\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 %u\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
    "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\n"
    "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    "JOINT Spine\n{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
    "End Site\n{\nOFFSET 0 1 0\n}\n}\n}\n"
    "MOTION\nFrames: 2\nFrame Time: 0.1\n0 0 0 0 0 0 0 0 0\n0 1 0 %u 0 0 10 20 30\n",
    "{'meshes':[{'name':'m','shape':{'kind':'grid','segments':[1%u,4]}}]}",
    "{'meshes':[{'name':'m','shape':{'kind':'torus','segments':8,'sides':1%u}}]}",
    "{'meshes':[{'name':'m','shape':{'kind':'cylinder','segments':1%u}}]}",
    "{'meshes':[{'name':'m','shape':{'kind':'grid','segments':[1%u,1]}}],'nodes':[{'name':'Spine','mesh':'m'}"
    "],"
    "'clips':[{'name':'x','layers':[{'clip':'{}/c'}]}]}",
};

static const char *const edits[] = {
    "{'edit':'extrude','faces':[0],'distance':0.5,'name':'e'}",
    "{'edit':'inset','faces':'all','amount':0.1}",
    "{'edit':'crease','edges':'all','sharpness':2}",
    "{'edit':'move','vertices':[0],'by':[0,0,0.25]}",
    "{'edit':'delete','faces':[0]}",
    "{'edit':'subdivide','faces':'all'}",
    "{'edit':'triangulate','faces':'all'}",
    "{'edit':'quads','faces':'all'}",
    "{'edit':'smooth','vertices':'all','iterations':2}",
    "{'edit':'weld','distance':0.01}",
    "{'edit':'flip','faces':'all'}",
    "{'edit':'fill','optional':true}",
};

/* Adds the id of the model that a request has made to s->ids. */
static void note_model(sequence *s, const reply *r) {
  if ((r->status != 200 && r->status != 201) || !r->body) return;
  cJSON *tree = cJSON_Parse(r->body);
  const char *id = cJSON_GetStringValue(cJSON_GetObjectItem(tree, "id"));
  if (id && strlen(id) < API_ID_TEXT) strcpy(s->ids[s->models++ % MODELS_MAX], id);
  cJSON_Delete(tree);
}

/* body: with ' in place of ". */
static void post(sequence *s, const char *target, const char *body) {
  char *text = quoted(body);
  reply r = loopback_ask(s->loop, "POST", target, NULL, text, strlen(text));
  free(text);
  if (r.status < 200 || r.status > 599 || r.status == 500) give_up("POST %s: %d", target, r.status);
  note_model(s, &r);
  reply_free(&r);
}

/* Appends text with "{}" replaced by the id of a model. Returns the new length. */
static size_t append(sequence *s, char *out, size_t size, size_t length, const char *text) {
  const char *mark = strstr(text, "{}");
  if (!mark) return length + (size_t)snprintf(out + length, size - length, "%s", text);
  return length + (size_t)snprintf(out + length, size - length, "%.*s%s%s", (int)(mark - text), text,
                                   choose_model(s), mark + 2);
}

static void document(sequence *s, char out[2048]) {
  char form[2048];
  append(s, form, sizeof form, 0, CHOOSE(s, documents));
  const char *mark = strstr(form, "%u");
  snprintf(out, 2048, "%.*s%u%s", (int)(mark - form), form, (unsigned)choose(s, 3), mark + 2);
}

static void upload(sequence *s) {
  static const char *const stored[] = {"/v1/models", "/v1/models?name=one", "/v1/models?name=two"};
  static const char *const targets[] = {"/v1/models", "/v1/surface.glb?level=1", "/v1/pose?at=0",
                                        "/v1/surface.json?level=auto", "/v1/surface.obj"};
  char body[2048];
  document(s, body);
  size_t name = choose(s, COUNT(stored) + 1);
  post(s, name < COUNT(stored) ? stored[name] : CHOOSE(s, targets), body);
}

static void edit(sequence *s) {
  char target[TARGET_MAX], body[2048];
  const char *id = choose_model(s);
  if (choose(s, 6) == 5) {
    snprintf(target, sizeof target, "/v1/models/%s/coarsen", id);
    post(s, target, "");
    return;
  }
  snprintf(target, sizeof target, "/v1/models/%s/edits", id);
  size_t length = (size_t)snprintf(body, sizeof body, "{'edits':[");
  for (size_t i = 0, count = 1 + choose(s, 3); i < count; i++)
    length +=
        (size_t)snprintf(body + length, sizeof body - length, "%s%s", i > 0 ? "," : "", CHOOSE(s, edits));
  snprintf(body + length, sizeof body - length, "]}");
  post(s, target, body);
}

static void remove_model(sequence *s) {
  char target[TARGET_MAX];
  snprintf(target, sizeof target, "/v1/models/%s", choose_model(s));
  reply r = loopback_ask(s->loop, "DELETE", target, NULL, NULL, 0);
  if (r.status != 204 && r.status != 404 && r.status != 503) give_up("DELETE %s: %d", target, r.status);
  bool is_gone = r.status == 204;
  reply_free(&r);
  if (!is_gone) return;
  r = loopback_get(s->loop, target);
  if (r.status != 404) give_up("%s: %d once it is deleted", target, r.status);
  reply_free(&r);
}

/* ---- questions ------------------------------------------------------------------------------- */

/* Parameters of all answers that play a clip. {}: the id of a model. */
#define OF_CLIP                                                                                              \
  "clip=c", "clip=x", "clip=clip_0", "clip={}/c", "clip={}/x", "clip={}/motion&retarget=auto",               \
      "clip={}/c&retarget=auto&feet=hold", "root_motion=auto", "root_motion=Hips&in_place=true"
static const char *const of_nothing[] = {""};
static const char *const of_tracks[] = {OF_CLIP};
static const char *const of_pose[] = {
    OF_CLIP,       "at=0,0.5",      "from=0&to=1&fps=10", "as=matrix",           "as=euler&order=ZXY",
    "space=world", "loop=pingpong", "nodes=Hips",         "interpolation=squad", "as=matrix&skinning=true"};
static const char *const of_bvh[] = {OF_CLIP, "from=0&to=1&fps=10", "order=ZXY", "loop=repeat"};
static const char *const of_surface[] = {
    OF_CLIP,
    "clip=none",
    "level=0",
    "level=1",
    "level=2",
    "level=3",
    "level=auto",
    "level=auto&error=1%25",
    "level=auto&faces=500",
    "scheme=loop",
    "scheme=bilinear",
    "boundary=open",
    "quads=off",
    "quads=auto",
    "polygons=ngon",
    "encoding=quantized",
    "at=0.5",
    "tolerance=1",
    "skin=bake",
    "limit=true",
    "normals=none",
    "weld=none",
    "weld=0.1",
    "creases=auto",
    "uv=boundaries",
    "mesh=0",
    "details=false",
    "influences=4",
    "meshes=none",
    "unit=mm",
    "shells=true",
    "triangles=smooth",
    "creasing=chaikin",
};

/* What a model is asked for, and with what. */
static const struct {
  const char *tail;
  const char *const *parameters;
  size_t count;
} questions[] = {
#define OF(tail, table)                                                                                      \
  { tail, table, COUNT(table) }
    OF("", of_nothing),
    OF("/source", of_nothing),
    OF("/tracks", of_tracks),
    OF("/pose.json", of_pose),
    OF("/pose.ndjson", of_pose),
    OF("/pose.csv", of_pose),
    OF("/pose.bin", of_pose),
    OF("/pose.bvh", of_bvh),
    OF("/levels.json", of_surface),
    OF("/surface.glb", of_surface),
    OF("/surface.gltf", of_surface),
    OF("/surface.json", of_surface),
    OF("/surface.obj", of_surface),
    OF("/surface.stl", of_surface),
    OF("/surface.ply", of_surface),
    OF("/surface.3mf", of_surface),
    OF("/surface.bin", of_surface),
#undef OF
};

static void question(sequence *s, char out[TARGET_MAX]) {
  size_t which = choose(s, COUNT(questions));
  size_t length =
      (size_t)snprintf(out, TARGET_MAX, "/v1/models/%s%s", choose_model(s), questions[which].tail);
  for (size_t i = 0, count = choose(s, 4); i < count; i++) {
    length = append(s, out, TARGET_MAX, length, i > 0 ? "&" : "?");
    length =
        append(s, out, TARGET_MAX, length, questions[which].parameters[choose(s, questions[which].count)]);
  }
}

static uint64_t hash_of(const reply *r) {
  uint64_t hash = 14695981039346656037u;
  for (size_t i = 0; i < r->size; i++) hash = (hash ^ (uint8_t)r->body[i]) * 1099511628211u;
  return hash;
}

/* Compares an answer with the earlier ones of the same target: equal tags mean equal bytes, and the tag
 * stays. Only answers that lack clips of absent models, which are no-cache, and other bytes of descriptions
 * may have another tag later: equal bytes may be uploaded under another name once the model was deleted. */
static void compare(sequence *s, const answered *now) {
  for (size_t i = 0; i < s->count && i < ANSWERS_MAX; i++) {
    const answered *before = &s->answers[i];
    if (strcmp(before->target, now->target) != 0) continue;
    bool has_same_tag = strcmp(before->tag, now->tag) == 0;
    if (has_same_tag && before->hash != now->hash)
      give_up("%s: other bytes with the tag %s", now->target, now->tag);
    bool may_change = before->is_partial || now->is_partial || (now->is_named && before->hash != now->hash);
    if (!has_same_tag && !may_change)
      give_up("%s: the tag is %s, and was %s before", now->target, now->tag, before->tag);
  }
  s->answers[s->count++ % ANSWERS_MAX] = *now;
}

/* Header fields that HEAD has too. X-Tweend-Warning is not among them: nothing is computed for HEAD, so that
 * it tells of shells only where they are known. */
static const char *const fields[] = {"ETag", "Content-Type", "X-Tweend-Error", "X-Tweend-Level"};
typedef struct fields_of {
  char *values[COUNT(fields)]; /* NULL: absent */
} fields_of;

static fields_of copy_fields(const reply *r) {
  fields_of copy = {0};
  for (size_t i = 0; i < COUNT(fields); i++) {
    const char *value = reply_header(r, fields[i]);
    copy.values[i] = value ? strdup(value) : NULL;
  }
  return copy;
}

static void free_fields(fields_of *of) {
  for (size_t i = 0; i < COUNT(fields); i++) free(of->values[i]);
}

/* Sends the same target with HEAD, and with its tag in If-None-Match. */
static void ask_again(sequence *s, const answered *now, const fields_of *got) {
  char condition[160];
  reply head = loopback_ask(s->loop, "HEAD", now->target, NULL, NULL, 0);
  if (head.status != now->status) give_up("HEAD %s: %d, GET %d", now->target, head.status, now->status);
  fields_of told = copy_fields(&head);
  for (size_t i = 0; i < COUNT(fields); i++) {
    const char *one = told.values[i], *other = got->values[i];
    if (!one != !other || (one && strcmp(one, other) != 0))
      give_up("HEAD %s: %s is %s, and %s for GET", now->target, fields[i], one ? one : "absent",
              other ? other : "absent");
  }
  free_fields(&told);
  reply_free(&head);
  if (now->status != 200 || !now->tag[0]) return;
  snprintf(condition, sizeof condition, "If-None-Match: %s\n", now->tag);
  reply unchanged = loopback_ask(s->loop, "GET", now->target, condition, NULL, 0);
  if (unchanged.status != 304) give_up("%s: %d for its own tag", now->target, unchanged.status);
  reply_free(&unchanged);
}

static void ask(sequence *s) {
  answered now = {0};
  size_t kept = s->count < ANSWERS_MAX ? s->count : ANSWERS_MAX;
  if (kept > 0 && choose(s, 2) == 1)
    strcpy(now.target, s->answers[choose(s, kept)].target);
  else
    question(s, now.target);
  reply r = loopback_get(s->loop, now.target);
  const char *tag = reply_header(&r, "ETag");
  const char *caching = reply_header(&r, "Cache-Control");
  fields_of got = copy_fields(&r);
  now.is_partial = caching && strstr(caching, "no-cache");
  now.is_named = strlen(now.target) == strlen("/v1/models/") + API_ID_TEXT - 1;
  now.status = r.status;
  now.hash = hash_of(&r);
  if (tag) snprintf(now.tag, sizeof now.tag, "%s", tag);
  reply_free(&r); /* the next request may need its memory */
  if (now.status < 200 || now.status > 599 || now.status == 500) give_up("%s: %d", now.target, now.status);
  if (now.status == 200 && now.tag[0]) compare(s, &now);
  if (choose(s, 3) == 0) ask_again(s, &now, &got);
  free_fields(&got);
}

/* ---- the sequence ---------------------------------------------------------------------------- */

static void step(sequence *s) {
  switch (choose(s, 8)) {
  case 0: upload(s); break;
  case 1: edit(s); break;
  case 2:
    if (choose(s, 3) == 0)
      remove_model(s);
    else
      upload(s);
    break;
  default: ask(s); break;
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size) {
  api_settings settings = loopback_settings();
  settings.limits.max_upload = 1 << 16;
  settings.limits.max_level = 3;
  settings.limits.max_faces = 20000;
  settings.limits.max_output = 1 << 20;
  settings.limits.max_times = 1000;
  settings.limits.max_memory = 24 << 20;
  settings.limits.plan_cache = 1 << 18; /* most of what was computed is forgotten soon */
  sequence *s = calloc(1, sizeof *s);
  if (!s) return 0;
  s->at = bytes;
  s->end = bytes + size;
  s->loop = loopback_start(&settings);
  upload(s);
  upload(s);
  for (int i = 0; i < STEPS_MAX && s->at < s->end; i++) step(s);
  api_usage usage;
  api_service_usage(s->loop->service, &usage);
  if (usage.granted != 0) give_up("%llu bytes stay granted", (unsigned long long)usage.granted);
  loopback_stop(s->loop);
  free(s);
  return 0;
}
