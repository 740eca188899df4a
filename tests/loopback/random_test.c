/* Models that have everything at once, edited, modelled onto, coarsened, stored and read in every way:
 * combinations that nobody thought of. A chain of requests follows from its number, which is printed before.
 */
#include "loopback.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tweend/json_print.h"

enum { CHAINS = 300, STEPS = 12, MESHES = 3, POINTS_MAX = 3000, WORD = 120, TEXT = 1000 };

typedef struct chain {
  loopback *loop;
  uint64_t state;
  char id[API_ID_TEXT]; /* of the model under way */
} chain;

/* Below `count`; splitmix64. */
static uint32_t pick(chain *c, uint32_t count) {
  uint64_t z = c->state += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return (uint32_t)((z ^ z >> 31) >> 33) % count;
}

/* One of words with a blank between two. In JSON ' stands for a quote, and # for any digit. */
static const char *pick_word(chain *c, const char *words, char out[WORD]) {
  uint32_t count = 1;
  for (const char *at = words; *at; at++) count += *at == ' ';
  for (count = pick(c, count); count > 0; count--) words = strchr(words, ' ') + 1;
  snprintf(out, WORD, "%.*s", (int)strcspn(words, " "), words);
  for (char *at = out; *at; at++)
    if (*at == '\'')
      *at = '"';
    else if (*at == '#')
      *at = (char)('0' + pick(c, 10));
  return out;
}

/* ---- models ---------------------------------------------------------------------------------- */

/* Lists of `width` numbers from -2 to 2, of so few different ones at times that rows are the same. */
static void put_rows(chain *c, tw_text *out, const char *name, uint32_t count, uint32_t width) {
  uint32_t steps = pick(c, 2) == 0 ? 2 : 2000;
  tw_member_open(out, name, "[");
  for (uint32_t i = 0; i < count * width; i++) {
    tw_text_add(out, i == 0 ? "[" : i % width == 0 ? "],[" : ",");
    tw_text_double(out, ((double)pick(c, 2 * steps + 1) - steps) * 2 / steps);
  }
  tw_text_add(out, "]]");
}

/* Prints the faces of a grid of side x side points: quads, some that come to a point twice, triangles, gaps,
 * and edges that three faces share.
 * With `values` over 0 it prints as many corners, each an index below `values` (of texture coordinates). */
static void put_faces(tw_text *out, const char *name, uint32_t side, uint32_t values) {
  chain sizes = {.state = side}; /* both lists have as many corners */
  tw_member_open(out, name, "[");
  for (uint32_t i = 0; i + side < side * side; i++) {
    const uint32_t points[5] = {i, i + 1, i + side + 1, i + side, side * side - 1};
    uint32_t kind = pick(&sizes, 8), size = kind == 1 ? 3 : kind == 2 && points[2] != points[4] ? 5 : 4;
    if (i % side == side - 1 || kind == 0) continue;
    tw_text_element(out);
    for (uint32_t k = 0; k < size; k++) {
      tw_text_add(out, k == 0 ? "[" : ",");
      tw_text_count(out, values ? (i * 7 + k * k) % values : points[kind == 3 && k == 2 ? 0 : k]);
    }
    tw_text_add(out, "]");
  }
  tw_text_add(out, "]");
}

static void put_mesh(chain *c, tw_text *out, uint32_t number) {
  static const char shapes[] =
      "box','segments':[2,1,1] cylinder','rings':2 uv_sphere','segments':6 icosphere' "
      "cone','caps':'fan' torus','segments':5";
  uint32_t side = 3 + pick(c, 4), at = pick(c, side * (side - 1)), values = 1 + pick(c, 9),
           sharpness = pick(c, 11);
  char text[TEXT], word[WORD];
  tw_text_element(out);
  snprintf(text, sizeof text, "{'name':'m%u'", number);
  tw_text_add(out, text);
  if (pick(c, 3) == 0) {
    snprintf(text, sizeof text, ",'shape':{'kind':'%s}", pick_word(c, shapes, word));
    tw_text_add(out, text);
  } else if (pick(c, 12) > 0) { /* else it is empty */
    put_rows(c, out, "positions", side * side, 3);
    put_faces(out, "faces", side, 0);
    bool of_points = pick(c, 3) == 0, of_corners = !of_points && pick(c, 2) == 0;
    if (of_points || of_corners) put_rows(c, out, "uvs", of_points ? side * side : values, 2);
    if (of_corners) put_faces(out, "face_uvs", side, values);
    snprintf(text, sizeof text,
             ",'creases':[{'edge':[%u,%u],'sharpness':%u},{'edge':[0,1],'sharpness':2.5}],"
             "'corners':[{'vertex':%u,'sharpness':1.5}]%s",
             at, at + side, sharpness, at, sharpness % 2 ? ",'holes':[0]" : "");
    if (pick(c, 4) > 0) tw_text_add(out, text);
  }
  tw_text_add(out, "}");
}

static const char nodes[] =
    "],'nodes':[{'name':'a','mesh':'m0','scale':[1,-1,2]},{'mesh':'m1','parent':'a'},"
    "{'mesh':'m1','translation':[5,0,0]},{'mesh':'m2'}],'clips':[{'tracks':[{'node':'a','path':'rotation',"
    "'times':[0,1],'eulers':[[0,0,0],[1,4,2]],'interpolation':'euler'},"
    "{'node':'a','path':'translation','times':[0.5],'values':[[1,2,3]]}]}]}";

/* ---- requests -------------------------------------------------------------------------------- */

/* Whatever is asked for, it is not the daemon's fault. What is made is the model under way from here on. */
static reply ask(chain *c, const char *target, const char *type, const void *body, size_t size) {
  reply r = loopback_ask(c->loop, body ? "POST" : "GET", target, type, body, size);
  if (r.status >= 500) fail_msg("%s: %d %s", target, r.status, r.body);
  cJSON *tree = body && r.status < 300 ? cJSON_Parse(r.body) : NULL;
  if (tree) snprintf(c->id, sizeof c->id, "%s", json_member(tree, "id")->valuestring);
  cJSON_Delete(tree);
  return r;
}

/* rest: of a path below the model's. */
static reply ask_of(chain *c, const char *rest, const char *body) {
  char target[TEXT + 80];
  snprintf(target, sizeof target, "/v1/models/%s/%s", c->id, rest);
  char *text = body ? quoted(body) : NULL;
  reply r = ask(c, target, text ? "Content-Type: application/json\n" : NULL, text, text ? strlen(text) : 0);
  free(text);
  return r;
}

static void upload(chain *c, const void *body, size_t size) {
  reply r = ask(c, "/v1/models", "Content-Type: application/octet-stream\n", body, size);
  if (r.status != 200 && r.status != 201) fail_msg("%d %s", r.status, r.body);
  reply_free(&r);
}

static void begin(chain *c) {
  static const char files[] =
      "gltf/animated.glb gltf/attributes.gltf gltf/cage.glb gltf/details.glb obj/tags.obj "
      "gltf/sparse.gltf gltf/ngon_twice.gltf obj/refined.obj json/whole";
  char path[WORD + 16], file[WORD];
  if (pick(c, 3) == 0) {
    size_t size;
    snprintf(path, sizeof path, "tests/fuzz/%s", pick_word(c, files, file));
    char *bytes = loopback_file(path, &size);
    upload(c, bytes, size);
    free(bytes);
    return;
  }
  tw_text out = {0};
  tw_text_add(&out, "{'meshes':[");
  for (uint32_t i = 0; i < MESHES; i++) put_mesh(c, &out, i);
  tw_text_add(&out, nodes);
  upload(c, quote_bytes(out.data, out.size), out.size);
  tw_text_deinit(&out);
}

static void get(chain *c) {
  static const char what[] = "surface.glb surface.gltf surface.obj surface.json tracks pose.bin?as=matrix "
                             "pose.csv?space=world";
  static const char *const parameters[] = {
      "level=0 level=1 level=2 level=3 level=4",
      "scheme=loop scheme=bilinear",
      "boundary=open boundary=none boundary=edge-only",
      "uv=all uv=none uv=boundaries uv=corners-plus1 uv=corners-plus2",
      "creasing=chaikin triangles=smooth",
      "creases=normals creases=auto creases=angle:30 creases=none creases=tags",
      "weld=exact weld=0.5 weld=none",
      "normals=limit normals=none",
      "encoding=quantized encoding=meshopt",
      "polygons=ngon quads=auto quads=off",
      "details=false limit=true",
      "at=0.3 clip=none at=0.3&skin=bake at=0,1"};
  char rest[TEXT], word[WORD];
  size_t length = (size_t)snprintf(rest, sizeof rest, "%s", pick_word(c, what, word));
  for (size_t i = 0; rest[0] == 's' && i < sizeof parameters / sizeof *parameters; i++)
    if (i == 0 || pick(c, 3) == 0)
      length += (size_t)snprintf(rest + length, sizeof rest - length, "%s%s", i == 0 ? "?" : "&",
                                 pick_word(c, parameters[i], word));
  reply r = ask_of(c, rest, NULL);
  reply_free(&r);
}

/* Stores a level as a model again, which must be readable. */
static void store_again(chain *c) {
  static const char levels[] = "level=0 level=0 level=1 level=1&encoding=meshopt level=0&encoding=quantized";
  char rest[WORD + 40], word[WORD];
  snprintf(rest, sizeof rest, "surface.glb?polygons=ngon&%s", pick_word(c, levels, word));
  reply r = ask_of(c, rest, NULL);
  if (r.status == 200 && r.size < c->loop->settings.limits.max_upload) upload(c, r.body, r.size);
  reply_free(&r);
}

static reply edit(chain *c, const char *mesh) {
  static const char edits[] =
      "extrude','faces':[#,#],'distance':0.3 inset','faces':'all','amount':0.#,'individual':true "
      "loop_cut','edge':[#,#],'cuts':2 subdivide','faces':[#],'cuts':2 subdivide','edges':'border' "
      "delete','faces':[#] delete','vertices':[#] merge','vertices':[#,#] fill','method':'fair' fill' "
      "mirror','axis':'x','weld':0.5 move','vertices':[#,#],'by':[1,0,1] "
      "crease','edges':'all','sharpness':#.5 "
      "corner','vertices':[#],'sharpness':# hole','faces':[#] flip','faces':[#] orient' triangulate' quads' "
      "drop_pieces','faces':2 despike' smooth','iterations':2 weld','distance':0.#";
  char body[TEXT], word[WORD];
  size_t length = (size_t)snprintf(body, sizeof body, "{'mesh':'%s','edits':[", mesh);
  for (uint32_t i = 0, count = 1 + pick(c, 3); i < count; i++)
    length += (size_t)snprintf(body + length, sizeof body - length, "%s{'optional':true,'edit':'%s}",
                               i ? "," : "", pick_word(c, edits, word));
  snprintf(body + length, sizeof body - length, "]}");
  return ask_of(c, "edits", body);
}

/* Moves all points of a level. */
static reply sculpt(chain *c, const char *mesh, uint32_t points, uint32_t level) {
  char rest[WORD];
  tw_text out = {0};
  tw_text_add(&out, "{");
  put_rows(c, &out, "positions", points, 3);
  tw_text_bytes(&out, "}", 2); /* and its terminator */
  snprintf(rest, sizeof rest, "detail?mesh=%s&level=%u", mesh, level);
  reply r = ask_of(c, rest, out.data);
  tw_text_deinit(&out);
  return r;
}

/* Edits, models onto, or coarsens one of the meshes. */
static void change(chain *c) {
  char rest[WORD], name[64];
  uint32_t level = pick(c, 5), action = pick(c, 5);
  snprintf(rest, sizeof rest, "surface.json?level=%u", level);
  reply r = ask_of(c, rest, NULL);
  cJSON *tree = cJSON_Parse(r.body);
  const cJSON *meshes = cJSON_GetObjectItem(tree, "meshes");
  uint32_t count = (uint32_t)cJSON_GetArraySize(meshes), index = count > 0 ? pick(c, count) : 0;
  const cJSON *mesh = cJSON_GetArrayItem(meshes, (int)index), *own = cJSON_GetObjectItem(mesh, "name");
  uint32_t points = mesh ? (uint32_t)json_member(mesh, "vertices")->valueint : 0;
  snprintf(name, sizeof name, "mesh_%u", index);
  if (cJSON_IsString(own)) snprintf(name, sizeof name, "%s", own->valuestring);
  cJSON_Delete(tree);
  reply_free(&r);
  snprintf(rest, sizeof rest, "coarsen?mesh=%s", name);
  if (action > 1 && points > 0 && points < POINTS_MAX)
    r = sculpt(c, name, points, level);
  else
    r = action == 0 ? ask_of(c, rest, "") : edit(c, name);
  reply_free(&r);
}

TEST(whatever_is_combined_is_answered) {
  static void (*const steps[8])(chain *) = {store_again, change, change, change, get, get, get, get};
  api_settings settings = loopback_settings();
  settings.limits.max_faces = 20000;
  for (uint32_t number = 0; number < CHAINS; number += test_stride()) {
    chain c = {.loop = loopback_start(&settings), .state = number};
    print_message("chain %u\n", number);
    begin(&c);
    for (int step = 0; step < STEPS; step++) steps[pick(&c, 8)](&c);
    loopback_stop(c.loop);
  }
}
