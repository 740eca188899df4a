/* Nothing that a file may hold is lost in silence: one row for each construct of each format's specification.
 * A row is kept or converted, and then an answer shows it, or it is told in a warning; and the plain file of
 * the format shows none of that. Or it is a mere comment, which means nothing: then nothing changes. */
#include <math.h>
#include <stdio.h>

#include "loopback.h"

/* Where a construct shows. */
typedef enum place {
  WARNING, /* in the warnings of the description */
  MODEL,   /* in the description */
  GLTF,    /* in surface.gltf at level 0 */
  OBJ,     /* in surface.obj at level 0 */
  SHAPE,   /* surface.gltf at level 0 is another one */
  HARD,    /* surface.obj at level 1 with creases=normals is another one */
  COMMENT  /* surface.gltf at level 0 and its warnings are the same */
} place;

typedef struct row {
  const char *construct, *text;
  place where;
  const char *shown; /* with ' in place of "; NULL from SHAPE on */
} row;

/* The answer in which a construct at that place shows; the caller frees it. */
static reply ask(loopback *loop, const char *type, const void *body, size_t size, place where) {
  static const char *const targets[] = {"/v1/models",
                                        "/v1/models",
                                        "/v1/surface.gltf?level=0",
                                        "/v1/surface.obj?level=0",
                                        "/v1/surface.gltf?level=0",
                                        "/v1/surface.obj?level=1&creases=normals",
                                        "/v1/surface.gltf?level=0"};
  char headers[64];
  snprintf(headers, sizeof headers, "Content-Type: %s\n", type);
  reply r = loopback_ask(loop, "POST", targets[where], headers, body, size);
  if (r.status >= 300) print_error("%s: %d %s\n", targets[where], r.status, r.body);
  return r;
}

/* Whether the answer shows the row. plain: the answer of the plain file at the same place. */
static bool shows(const reply *r, const reply *plain, const row *row) {
  bool is_same = plain && r->size == plain->size && memcmp(r->body, plain->body, r->size) == 0;
  if (row->where == COMMENT) {
    const char *warning = reply_header(r, "X-Tweend-Warning"),
               *other = reply_header(plain, "X-Tweend-Warning");
    return is_same && strcmp(warning ? warning : "", other ? other : "") == 0;
  }
  if (row->where >= SHAPE) return !is_same;
  const char *part = row->where == WARNING ? strstr(r->body, "\"warnings\"") : r->body;
  return part && says(part, row->shown);
}

static void assert_told(loopback *loop, const char *type, const row *row, const void *body, size_t size,
                        const void *plain_body, size_t plain_size) {
  reply r = ask(loop, type, body, size, row->where),
        plain = ask(loop, type, plain_body, plain_size, row->where);
  assert_true(r.status < 300 && plain.status < 300);
  if (!shows(&r, &plain, row)) fail_msg("%s is lost in silence:\n%s", row->construct, r.body);
  if (row->where < SHAPE && shows(&plain, &plain, row)) fail_msg("%s shows without it", row->construct);
  reply_free(&r);
  reply_free(&plain);
}

/* rows: texts in which '@' stands for the plain file. */
static void assert_all_told(loopback *loop, const char *type, const char *plain, const row *rows,
                            size_t count) {
  for (size_t i = 0; i < count; i++) {
    char text[4096];
    const char *at = strchr(rows[i].text, '@');
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at ? at - rows[i].text : 0), rows[i].text, at ? plain : "",
             at ? at + 1 : rows[i].text);
    assert_told(loop, type, &rows[i], text, strlen(text), plain, strlen(plain));
  }
}

/* ---- OBJ: appendix B1 of Wavefront's manual, and what tools added ---------------------------- */

#define FOLD "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n"

TEST_WITH(obj_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
  static const row rows[] = {
      {"v w", "@v 5 5 5 2\nf 1 2 5\n", WARNING, "weight of a point"},
      {"v r g b", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", GLTF, "COLOR_0"},
      {"v r g b a", "v 0 0 0 1 0 0 0.5\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", WARNING, "alpha of a colour"},
      {"v r g b in bytes", "v 0 0 0 255 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", WARNING, "divided by 255"},
      {"v r g b beyond 1", "v 0 0 0 2.5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", WARNING, "brought into 0 to 1"},
      {"v with more", "v 0 0 0 1 0 0 1 9\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", WARNING, "behind its colour"},
      {"a comment", "# by hand\n@", COMMENT, NULL},
      {"#MRGB", "@#MRGB ffff0000ff00ff00ff0000ffffffffff\n", GLTF, "COLOR_0"},
      {"#MRGB with a mask", "@#MRGB 80ff0000ff00ff00ff0000ffffffffff\n", WARNING, "1 mask of a point"},
      {"#MRGB of more points", "#MRGB ffff0000ff00ff00ff0000ffffffffffffffffff\n@", WARNING,
       "colours (#MRGB) is not read to its end"},
      {"#MRGB that is none", "@#MRGB ffff00zz\n", WARNING, "colours (#MRGB) is not read to its end"},
      {"a point of no face", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n", WARNING, "point is in no face"},
      {"vt u v", "vt 0.25 0.75\n@f 1/1 2/1 4/1\n", OBJ, "vt 0.25 0.75"},
      {"vt of no corner", "vt 0.25 0.75\n@", WARNING, "1 texture coordinate of no corner"},
      {"vt u v w", "vt 0.25 0.75 0.5\n@f 1/1 2/1 4/1\n", WARNING, "third texture coordinate"},
      {"vt without v", "@f 1/1 2/1 4/1\n", WARNING, "the file has no vt"},
      {"vt of some corners", "vt 0.25 0.75\n@f 1/1 2 4\n", WARNING, "get 0 0"},
      {"vn", "vn 0.6 0.8 0\n@f 1//1 2//1 4//1\n", OBJ, "vn 0.6 0.8 0"},
      {"vn of another length", "vn 0 3 4\n@f 1//1 2//1 4//1\n", OBJ, "vn 0 0.6 0.8"},
      {"vn of no corner", "vn 0 0 1\n@", WARNING, "1 normal of no corner"},
      {"vn that is none", "vn nan 0 0\n@", WARNING, "normal is left out"},
      {"vn without v", "@f 1//1 2//1 4//1\n", WARNING, "the file has no vn"},
      {"f of two corners", "@f 1 2\n", WARNING, "fewer than three"},
      {"f with a corner twice", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 2 4\n", WARNING,
       "2 edges have one face on both sides"},
      {"f with a doubled corner", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2 3\n", WARNING, "twice in a row"},
      {"fo", "v 0 0 0\nv 1 0 0\nv 0 1 0\nfo 1 2 3\n", SHAPE, NULL},
      {"o", "o part\n@", OBJ, "o part\n"},
      {"o that shares points", "o a\n@o b\nf 2 3 4\n", WARNING, "object is one mesh"},
      {"faces before the first o", "@v 5 0 0\nv 6 0 0\nv 5 1 0\no b\nf -1 -2 -3\n", MODEL,
       "'name':'b','vertices':3,"},
      {"o without faces", "o a\no b\n@", WARNING, "object without faces"},
      {"g", "g left right\n@", GLTF, "['left','right']"},
      {"g without faces", "o a\ng idle\ng used\n@", WARNING, "1 set of groups without faces"},
      {"g with faces further on", "o a\ng used\n# none\ng default\n@g used\nf 2 3 4\n", GLTF, "['used']"},
      {"s", "s off\n@", HARD, NULL},
      {"s of no number", "s all\n@", WARNING, "smoothing group is left out"},
      {"usemtl", "usemtl red\n@", GLTF, "'name':'red'"},
      {"mtllib", "mtllib a.mtl\n@", WARNING, "libraries of materials"},
      {"mtllib and usemtl", "mtllib a.mtl\nusemtl red\n@", WARNING, "the name alone is kept"},
      {"t crease", "@t crease 2/1/0 0 1 2.5\n", OBJ, "t crease"},
      {"t corner", "@t corner 1/1/0 0 2\n", OBJ, "t corner"},
      {"t hole", "@t hole 1/0/0 0\n", SHAPE, NULL},
      {"t creasemethod", "@t crease 2/1/0 0 1 2\nt creasemethod 0/0/1 chaikin\n", OBJ, "t creasemethod"},
      {"t interpolateboundary", "@t interpolateboundary 1/0/0 2\n", OBJ, "t interpolateboundary"},
      {"t facevaryinginterpolateboundary",
       "vt 0 0\n@f 1/1 2/1 4/1\nt facevaryinginterpolateboundary 1/0/0 5\n", OBJ,
       "t facevaryinginterpolateboundary"},
      {"t smoothtriangles", "@t smoothtriangles 0/0/1 smooth\n", OBJ, "t smoothtriangles"},
      {"t of another name", "@t vertexedit 1/1/1 0 1 a\n", WARNING, "subdivision tag"},
      {"another statement", "@pose 1\n", WARNING, "none that is known"}};
  assert_all_told(*state, "model/obj", FOLD, rows, sizeof rows / sizeof *rows);
  static const char *const ignored[][2] = {
      {"line, point or curve", "l p curv curv2 surf"},
      {"free-form",
       "vp cstype deg bmat step parm trim hole scrv sp end con mg ctech stech bsp bzp cdc cdp res"},
      {"display and files", "bevel c_interp d_interp lod shadow_obj trace_obj usemap maplib call csh"}};
  for (size_t i = 0; i < sizeof ignored / sizeof *ignored; i++) {
    char words[200], text[64];
    snprintf(words, sizeof words, "%s", ignored[i][1]);
    for (char *rest = NULL, *word = strtok_r(words, " ", &rest); word; word = strtok_r(NULL, " ", &rest)) {
      snprintf(text, sizeof text, "@%s 1 2 3\n", word);
      const row one = {word, text, WARNING, ignored[i][0]};
      assert_all_told(*state, "model/obj", FOLD, &one, 1);
    }
  }
}

/* ---- PLY: Turk's format, with the elements and properties that tools agree on ---------------- */

#define PLY_HEAD   "ply\nformat ascii 1.0\n"
#define PLY_XYZ(n) "element vertex " n "\nproperty float x\nproperty float y\nproperty float z\n"
#define PLY_FACE   "element face 1\nproperty list uchar int vertex_indices\n"
#define PLY_END    "end_header\n"

TEST_WITH(ply_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
  static const char plain[] = PLY_HEAD PLY_XYZ("3") PLY_FACE PLY_END "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
#define VERTEX(properties, more)                                                                             \
  PLY_HEAD PLY_XYZ("3") properties PLY_FACE PLY_END "0 0 0 " more "\n1 0 0 " more "\n0 1 0 " more            \
                                                    "\n3 0 1 2\n"
#define FACE(properties, more)                                                                               \
  PLY_HEAD PLY_XYZ("3") PLY_FACE properties PLY_END "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 " more "\n"
#define REST PLY_XYZ("3") PLY_FACE
#define ROWS "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
#define RGB  "property uchar red\nproperty uchar green\nproperty uchar blue\n"
  static const row rows[] = {
      {"comment", PLY_HEAD "comment by hand\n" REST PLY_END ROWS, COMMENT, NULL},
      {"another version", "ply\nformat ascii 2.0\n" REST PLY_END ROWS, WARNING, "words that are left out"},
      {"a second format", PLY_HEAD "format ascii 1.0\n" REST PLY_END ROWS, WARNING, "line of the header"},
      {"words behind a line", PLY_HEAD REST "end_header now\n" ROWS, WARNING, "words that are left out"},
      {"comment TextureFile", PLY_HEAD "comment TextureFile a.png\n" REST PLY_END ROWS, WARNING,
       "line of the header"},
      {"obj_info", PLY_HEAD "obj_info by hand\n" REST PLY_END ROWS, WARNING, "line of the header"},
      {"another line", PLY_HEAD "units mm\n" REST PLY_END ROWS, WARNING, "line of the header"},
      {"another element", PLY_HEAD REST "element edge 1\nproperty int a\n" PLY_END ROWS "1\n", WARNING,
       "left out: edge"},
      {"a second element vertex", PLY_HEAD REST "element vertex 1\nproperty int x\n" PLY_END ROWS "1\n",
       WARNING, "left out: vertex"},
      {"normals", VERTEX("property float nx\nproperty float ny\nproperty float nz\n", "1 0 0"), SHAPE, NULL},
      {"a normal that is none",
       VERTEX("property float nx\nproperty float ny\nproperty float nz\n", "nan 0 0"), WARNING,
       "normals are left out"},
      {"a part of normals", VERTEX("property float nx\n", "1"), WARNING, "vertex.nx"},
      {"colours", VERTEX(RGB, "255 0 0"), GLTF, "COLOR_0"},
      {"alpha", VERTEX(RGB "property uchar alpha\n", "255 0 0 9"), GLTF, "COLOR_0"},
      {"a part of colours", VERTEX("property uchar red\n", "255"), WARNING, "vertex.red"},
      {"texture coordinates", VERTEX("property float s\nproperty float t\n", "0.25 0.5"), OBJ, "vt 0.25 0.5"},
      {"a part of them", VERTEX("property float u\n", "0.25"), WARNING, "vertex.u"},
      {"another property", VERTEX("property float quality\n", "1"), WARNING, "vertex.quality"},
      {"a list of vertices", VERTEX("property list uchar int near\n", "1 2"), WARNING, "vertex.near"},
      {"colours of faces", FACE(RGB, "255 0 0"), GLTF, "COLOR_0"},
      {"texcoord", FACE("property list uchar float texcoord\n", "6 0 0 0.25 0.5 0 1"), OBJ, "vt 0.25 0.5"},
      {"texcoord of other numbers", FACE("property list uchar float texcoord\n", "2 0 0"), WARNING,
       "texture coordinates 0 0"},
      {"texnumber", FACE("property int texnumber\n", "1"), WARNING, "face.texnumber"},
      {"tristrips",
       PLY_HEAD PLY_XYZ("4") "element tristrips 1\nproperty list int int vertex_indices\n" PLY_END
                             "0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n",
       MODEL, "'faces':2,"},
      {"faces without corners",
       PLY_HEAD PLY_XYZ("3") "element face 1\nproperty int a\n" PLY_END "0 0 0\n1 0 0\n0 1 0\n7\n", WARNING,
       "left out: face"},
      {"a point of no face", PLY_HEAD PLY_XYZ("4") PLY_FACE PLY_END "0 0 0\n1 0 0\n0 1 0\n9 9 9\n3 0 1 2\n",
       WARNING, "point is in no face"},
      {"a doubled corner", PLY_HEAD PLY_XYZ("3") PLY_FACE PLY_END "0 0 0\n1 0 0\n0 1 0\n4 0 1 1 2\n", WARNING,
       "twice in a row"},
      {"more numbers in a line", PLY_HEAD PLY_XYZ("3") PLY_FACE PLY_END "0 0 0 1\n0 0\n0 1 0\n3 0 1 2\n",
       WARNING, "1 line has more numbers than its row, in line 10"},
      {"bytes behind", PLY_HEAD REST PLY_END ROWS "more", WARNING, "behind the last element"}};
  assert_all_told(*state, "model/ply", plain, rows, sizeof rows / sizeof *rows);
}

/* ---- STL ------------------------------------------------------------------------------------- */

TEST_WITH(text_of_stl_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
#define FACET(normal)                                                                                        \
  "facet normal " normal "\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
  static const row rows[] = {
      {"the name of a solid", "solid part\n" FACET("0 0 1") "endsolid\n", MODEL, "'name':'part'"},
      {"a second solid", "solid\n" FACET("0 0 1") "endsolid\nsolid\nendsolid\n", WARNING,
       "solid is one mesh with the first"},
      {"a normal against the corners", "solid\n" FACET("0 0 -1") "endsolid\n", WARNING, "against the order"},
      {"a normal that is none", "solid\n" FACET("nan 0 0") "endsolid\n", WARNING, "no three finite numbers"},
      {"a normal of two numbers", "solid\n" FACET("0 0") "endsolid\n", WARNING, "no three finite numbers"},
      {"another name at its end", "solid a\n" FACET("0 0 1") "endsolid b\n", WARNING, "name behind endsolid"},
      {"the name again at its end", "solid\n" FACET("0 0 1") "endsolid\n", COMMENT, NULL},
      {"a loop of four",
       "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n"
       "vertex 0 1 0\nendloop\nendfacet\nendsolid\n",
       SHAPE, NULL},
      {"another word", "solid\n" FACET("0 0 1") "color 1 0 0\nendsolid\n", WARNING, "words are left out"}};
  assert_all_told(*state, "model/stl", "solid\n" FACET("0 0 1") "endsolid\n", rows,
                  sizeof rows / sizeof *rows);
}

/* A facet with a header, an attribute, and bytes behind it. */
static size_t binary_facet(uint8_t out[400], const char *header, uint16_t attribute, const char *behind,
                           size_t facets) {
  static const float numbers[12] = {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0};
  memset(out, 0, 400);
  memcpy(out, header, strlen(header));
  out[80] = 1;
  for (size_t f = 0; f < facets; f++) {
    memcpy(out + 84 + 50 * f, numbers, sizeof numbers);
    memcpy(out + 84 + 50 * f + 48, &attribute, 2);
  }
  memcpy(out + 84 + 50 * facets, behind, strlen(behind));
  return 84 + 50 * facets + strlen(behind);
}

TEST_WITH(binary_stl_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
  static const struct {
    row row;
    const char *header;
    uint16_t attribute;
    const char *behind;
    size_t facets;
  } rows[] = {
      {{"VisCAM's colour", NULL, GLTF, "COLOR_0"}, "", 0x801F, "", 1},
      {{"Magics' colour", NULL, GLTF, "COLOR_0"}, "COLOR=abcd", 0x001F, "", 1},
      {{"Magics' material", NULL, WARNING, "material of the header"},
       "COLOR=abcd,MATERIAL=abcdefghijkl",
       0,
       "",
       1},
      {{"text of the header", NULL, WARNING, "header is left out: \\'units: mm\\'"}, "units: mm", 0, "", 1},
      {{"text beside a colour", NULL, WARNING, "header is left out: \\'by hand\\'"},
       "by hand, COLOR=abcd",
       0,
       "",
       1},
      {{"blanks in the header", NULL, COMMENT, NULL}, "  \t ", 0, "", 1},
      {{"another attribute", NULL, WARNING, "attributes that are left out"}, "", 7, "", 1},
      {{"bytes of an attribute", NULL, WARNING, "attributes that are left out"}, "", 4, "abcd", 1},
      {{"bytes behind", NULL, WARNING, "bytes behind the facets"}, "", 0, "abcd", 1},
      {{"facets behind", NULL, WARNING, "behind those that the file counts"}, "", 0, "", 3}};
  uint8_t body[400], plain[400];
  size_t plain_size = binary_facet(plain, "", 0, "", 1);
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    size_t size = binary_facet(body, rows[i].header, rows[i].attribute, rows[i].behind, rows[i].facets);
    assert_told(*state, "model/stl", &rows[i].row, body, size, plain, plain_size);
  }
}

TEST_WITH(attributes_beside_colours_are_told, loopback_setup, loopback_teardown) {
  uint8_t body[400];
  size_t size = binary_facet(body, "", 0x801F, "", 2);
  body[80] = 2;
  body[84 + 50 + 48] = 7;
  body[84 + 50 + 49] = 0;
  const row one = {"an attribute", NULL, WARNING, "1 facet has attributes"};
  reply r = ask(*state, "model/stl", body, size, one.where);
  assert_true(shows(&r, NULL, &one));
  reply_free(&r);
}

/* ---- BVH ------------------------------------------------------------------------------------- */

TEST_WITH(bvh_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
#define JOINT(offset, channels, end)                                                                         \
  "HIERARCHY\nROOT hip\n{\n" offset "CHANNELS " channels "\nEnd Site" end "\n{\nOFFSET 0 1 0\n}\n}\n"
#define FRAMES(count) "MOTION\nFrames: " count "\nFrame Time: 0.5\n"
  static const row rows[] = {
      {"OFFSET", JOINT("OFFSET 0 7 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n", MODEL, "[0,7,0]"},
      {"a second OFFSET", JOINT("OFFSET 0 1 0\nOFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n",
       WARNING, "OFFSET takes the place"},
      {"a channel of scale", JOINT("OFFSET 0 2 0\n", "2 Zrotation Xscale", "") FRAMES("2") "0 1\n90 1\n",
       WARNING, "channel of scale is left out"},
      {"the name of an End Site", JOINT("OFFSET 0 2 0\n", "1 Zrotation", " tip") FRAMES("2") "0\n90\n",
       WARNING, "name of 1 end site"},
      {"Frames of another number", JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("9") "0\n90\n", WARNING,
       "Frames: says 9"},
      {"no frames", JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("0"), WARNING, "there are no frames"},
      {"no MOTION", JOINT("OFFSET 0 2 0\n", "1 Zrotation", ""), WARNING, "there is no MOTION"},
      {"a comma", JOINT("OFFSET 0 2,5 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n", WARNING, "a comma"},
      {"Frame Time", JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("3") "0\n90\n0\n", MODEL,
       "'duration':1,"},
      {"position channels", JOINT("OFFSET 0 2 0\n", "1 Zposition", "") FRAMES("2") "0\n9\n", GLTF,
       "'path':'translation'"}};
  assert_all_told(*state, "application/octet-stream",
                  JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n", rows,
                  sizeof rows / sizeof *rows);
}

/* ---- tweend JSON: a member is read or refused ------------------------------------------------ */

TEST_WITH(tweend_json_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
#define MESH "'positions':[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],'faces':[[0,1,2],[0,2,3]]"
#define CLIP(track)                                                                                          \
  "{'meshes':[{" MESH "}],'nodes':[{'name':'n'}],'clips':[{'name':'c','tracks':[{'node':'n'," track "}]}]}"
  static const row rows[] = {
      {"name of a mesh", "{'meshes':[{'name':'m'," MESH "}]}", MODEL, "'name':'m'"},
      {"uvs", "{'meshes':[{" MESH ",'uvs':[[0.25,0.5],[1,0],[0,1],[1,1]]}]}", OBJ, "vt 0.25 0.5"},
      {"face_uvs", "{'meshes':[{" MESH ",'uvs':[[0.25,0.5]],'face_uvs':[[0,0,0],[0,0,0]]}]}", OBJ,
       "vt 0.25 0.5"},
      {"creases", "{'meshes':[{" MESH ",'creases':[{'edge':[0,1],'sharpness':2.5}]}]}", OBJ, "t crease"},
      {"corners", "{'meshes':[{" MESH ",'corners':[{'vertex':0,'sharpness':2}]}]}", OBJ, "t corner"},
      {"holes", "{'meshes':[{" MESH ",'holes':[1]}]}", SHAPE, NULL},
      {"shape", "{'meshes':[{'shape':{'kind':'box'}}]}", MODEL, "'faces':6,"},
      {"edits", "{'meshes':[{" MESH ",'edits':[{'edit':'extrude','faces':'all','distance':1}]}]}", MODEL,
       "'faces':6,"},
      {"nodes", "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'name':'n','mesh':'m'}]}", MODEL, "'name':'n'"},
      {"parent", "{'nodes':[{'name':'n'},{'name':'p','parent':'n'}],'meshes':[{" MESH "}]}", MODEL,
       "'parent':'n'"},
      {"translation", "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','translation':[0,0,7]}]}", OBJ,
       "v 0 0 7"},
      {"rotation", "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','rotation':[0,0,1,0]}]}", OBJ,
       "v -1 0 0"},
      {"a point of no face", "{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0],[9,9,9]],'faces':[[0,1,2]]}]}",
       WARNING, "1 point is in no face"},
      {"a mesh of no node", "{'meshes':[{'name':'m'," MESH "},{'name':'q'," MESH "}],'nodes':[{'mesh':'m'}]}",
       WARNING, "1 mesh is in no node"},
      {"rotation off unit length",
       "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','rotation':[0,0,0,2]}]}", WARNING,
       "1 node has a rotation"},
      {"a clip without tracks", "{'meshes':[{" MESH "}],'clips':[{'name':'c','tracks':[]}]}", WARNING,
       "1 clip has no tracks"},
      {"scale", "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','scale':[7,1,1]}]}", OBJ, "v 7 0 0"},
      {"quaternions", CLIP("'path':'rotation','times':[0,1],'quaternions':[[0,0,0,1],[0,0,1,0]]"), MODEL,
       "'name':'c'"},
      {"values", CLIP("'path':'translation','interpolation':'step','times':[0,1],'values':[[0,0,0],[1,0,0]]"),
       GLTF, "STEP"}};
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    char *text = quoted(rows[i].text), *plain = quoted("{'meshes':[{" MESH "}]}");
    assert_told(*state, "application/json", &rows[i], text, strlen(text), plain, strlen(plain));
    free(text);
    free(plain);
  }
  assert_problem(loopback_post(*state, "/v1/models", "application/json", "{'meshes':[{" MESH ",'more':1}]}"),
                 400, "/meshes/0", "unknown member");
}

/* ---- glTF 2.0: the properties of its schemas, in their order --------------------------------- */

/* A document; a member that is NULL adds nothing. All begin with a comma. */
typedef struct gltf_row {
  row row;
  const char *accessor, *asset, *buffer, *view, *node, *attribute, *primitive, *mesh, *sampler, *channel,
      *target, *animation, *rest;
} gltf_row;

static const char *or_nothing(const char *text) {
  return text ? text : "";
}

/* Four points, the triangles of a tetrahedron, two times, two moves; a node that moves. */
static void write_gltf(char out[4096], const gltf_row *r) {
  snprintf(
      out, 4096,
      "{'asset':{'version':'2.0'%s},'buffers':[{'byteLength':104,'uri':'data:application/octet-stream;base64,"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/"
      "AAACAAEAAAABAAMAAQACAAMAAgAAAAMAAAAAAAAAgD8A"
      "AAAAAAAAAAAAAAAAAIA/AAAAQAAAQEA='%s}],'bufferViews':[{'buffer':0,'byteLength':48%s},{'buffer':0,"
      "'byteOffset':48,'byteLength':24},{'buffer':0,'byteOffset':72,'byteLength':8},{'buffer':0,'byteOffset':"
      "80,"
      "'byteLength':24},{'buffer':0,'byteLength':104}],'accessors':[{'bufferView':0,'componentType':5126,'"
      "count':4,"
      "'type':'VEC3'%s},{'bufferView':1,'componentType':5123,'count':12,'type':'SCALAR'},{'bufferView':2,"
      "'componentType':5126,'count':2,'type':'SCALAR'},{'bufferView':3,'componentType':5126,'count':2,"
      "'type':'VEC3'},{'bufferView':0,'componentType':5126,'count':4,'type':'VEC2'},{'bufferView':4,"
      "'componentType':5126,'count':4,'type':'VEC4'},{'bufferView':0,'componentType':5121,'count':4,"
      "'type':'VEC4'},{'componentType':5121,'count':4,'type':'VEC4'},{'bufferView':4,'byteOffset':72,'"
      "componentType':"
      "5126,'count':2,'type':'VEC4'},{'bufferView':0,'componentType':5125,'count':4,'type':'SCALAR'},"
      "{'componentType':5126,'count':1,'type':'MAT4'}],"
      "'meshes':[{'primitives':[{'attributes':"
      "{'POSITION':0%s},'indices':1%s}]%s}],"
      "'nodes':[{'mesh':0%s},{},{}],'animations':[{'samplers':[{'input':2,'output':3%s}],'channels':[{'"
      "sampler':0,"
      "'target':{'node':0,'path':'translation'%s}%s}]%s}]%s}",
      or_nothing(r->asset), or_nothing(r->buffer), or_nothing(r->view), or_nothing(r->accessor),
      or_nothing(r->attribute), or_nothing(r->primitive), or_nothing(r->mesh), or_nothing(r->node),
      or_nothing(r->sampler), or_nothing(r->target), or_nothing(r->channel), or_nothing(r->animation),
      or_nothing(r->rest));
  quote(out);
}

TEST_WITH(gltf_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
#define FIVE(name, a, b, c, d, e)                                                                            \
  ",'" name a "':0,'" name b "':0,'" name c "':0,'" name d "':0,'" name e "':0"
#define TEN(name) FIVE(name, "0", "1", "2", "3", "4") FIVE(name, "5", "6", "7", "8", "9")
  static const gltf_row rows[] = {
      {{"accessor.name", NULL, WARNING, "unknown members of 1"}, .accessor = ",'name':'a'"},
      {{"accessor.extras", NULL, WARNING, "unknown members of 1"}, .accessor = ",'extras':1"},
      {{"accessor.sparse", NULL, SHAPE, NULL},
       .accessor = ",'sparse':{'count':1,'indices':{'bufferView':1,'byteOffset':2,'componentType':5123},"
                   "'values':{'bufferView':3,'byteOffset':12}}"},
      {{"animation.name", NULL, GLTF, "'name':'walk'"}, .animation = ",'name':'walk'"},
      {{"animation without channels", NULL, WARNING, "1 clip has no tracks"},
       .animation = "},{'channels':[],'samplers':[]"},
      {{"animation.extras", NULL, GLTF, "'extras':{'a':1}"}, .animation = ",'extras':{'a':1}"},
      {{"channel.extras", NULL, GLTF, "'extras':{'c':1}"}, .channel = ",'extras':{'c':1}"},
      {{"target.extras", NULL, GLTF, "'extras':{'t':1}"}, .target = ",'extras':{'t':1}"},
      {{"sampler.interpolation", NULL, GLTF, "'interpolation':'STEP'"}, .sampler = ",'interpolation':'STEP'"},
      {{"sampler that no channel names", NULL, WARNING, "sampler of an animation"},
       .sampler = "},{'input':2,'output':3"},
      {{"asset.copyright", NULL, GLTF, "'copyright':'me'"}, .asset = ",'copyright':'me'"},
      {{"asset.extras", NULL, GLTF, "'extras':{'a':1}"}, .asset = ",'extras':{'a':1}"},
      {{"asset.generator", NULL, COMMENT, NULL}, .asset = ",'generator':'by hand'"},
      {{"buffer.name", NULL, WARNING, "unknown members of 1"}, .buffer = ",'name':'b'"},
      {{"a member that accessors have not", NULL, WARNING, "unknown members of 1"}, .accessor = ",'more':1"},
      {{"sparse.extras", NULL, WARNING, "unknown members of 1"},
       .accessor = ",'sparse':{'count':1,'indices':{'bufferView':1,'byteOffset':2,'componentType':5123},"
                   "'values':{'bufferView':3,'byteOffset':12},'extras':1}"},
      {{"buffer that nothing reads", NULL, WARNING, "nothing that is read lies in it"},
       .buffer = "},{'byteLength':5,'uri':'absent.bin'"},
      {{"bufferView.name", NULL, WARNING, "unknown members of 1"}, .view = ",'name':'v'"},
      {{"camera", NULL, GLTF, "'znear':0.5"},
       .rest = ",'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':0.5}}]"},
      {{"extensionsUsed", NULL, GLTF, "'extensionsUsed':['KHR_materials_unlit']"},
       .rest = ",'extensionsUsed':['KHR_materials_unlit'],'materials':[{'extensions':{'KHR_materials_unlit':{"
               "}}}]"},
      {{"an extension that is not declared", NULL, GLTF, "'extensionsUsed':['KHR_materials_unlit']"},
       .rest = ",'materials':[{'extensions':{'KHR_materials_unlit':{}}}]"},
      {{"extensions", NULL, GLTF, "'ACME_a':{'b':1}"}, .rest = ",'extensions':{'ACME_a':{'b':1}}"},
      {{"extensions that name views", NULL, WARNING, "ACME_a at the root"},
       .rest = ",'extensions':{'ACME_a':{'bufferView':1}}"},
      {{"extras", NULL, GLTF, "'extras':{'r':1}"}, .rest = ",'extras':{'r':1}"},
      {{"image", NULL, GLTF, "'name':'picture'"},
       .rest = ",'images':[{'name':'picture','uri':'data:image/png;base64,iVBORw0KGgo='}]"},
      {{"image on the web", NULL, WARNING, "an address on the web"},
       .rest = ",'images':[{'uri':'http://a/b.png'}]"},
      {{"material", NULL, GLTF, "'doubleSided':true"}, .rest = ",'materials':[{'doubleSided':true}]"},
      {{"mesh.name", NULL, GLTF, "'name':'m'"}, .mesh = ",'name':'m'"},
      {{"mesh.weights", NULL, GLTF, "'weights':[0.5]"},
       .primitive = ",'targets':[{'POSITION':0}]",
       .mesh = ",'weights':[0.5]"},
      {{"mesh.extras", NULL, GLTF, "'extras':{'m':1}"}, .mesh = ",'extras':{'m':1}"},
      {{"mesh that no node shows", NULL, WARNING, "in no node of the shown scene"},
       .mesh = "},{'primitives':[{'attributes':{'POSITION':0},'indices':1}]"},
      {{"primitives of one material", NULL, WARNING, "becomes one with another"},
       .primitive = "},{'attributes':{'POSITION':0},'indices':1"},
      {{"primitive without POSITION", NULL, WARNING, "without POSITION"}, .primitive = "},{'attributes':{}"},
      {{"primitive.material", NULL, GLTF, "'material':0"},
       .primitive = ",'material':0",
       .rest = ",'materials':[{}]"},
      {{"primitive.mode of points", NULL, GLTF, "'mode':0"},
       .primitive = "},{'attributes':{'POSITION':0},'mode':0"},
      {{"an attribute of points with a blank", NULL, WARNING, "_a b of points and lines is left out"},
       .primitive = "},{'attributes':{'POSITION':0,'_a b':0},'mode':0"},
      {{"primitive.mode of strips", NULL, SHAPE, NULL}, .primitive = ",'mode':5"},
      {{"primitive.mode of fans", NULL, SHAPE, NULL}, .primitive = ",'mode':6"},
      {{"mesh.extensions that may name accessors", NULL, WARNING, "ACME_a at /meshes/0"},
       .mesh = ",'extensions':{'ACME_a':{'loops':[1]}}"},
      {{"KHR_xmp_json_ld", NULL, GLTF, "'KHR_xmp_json_ld':{'packet':0}"},
       .mesh = ",'extensions':{'KHR_xmp_json_ld':{'packet':0}}"},
      {{"primitive.extras", NULL, GLTF, "'extras':{'p':1}"}, .primitive = ",'extras':{'p':1}"},
      {{"primitive.extensions", NULL, GLTF, "'ACME_a':{'b':'c'}"},
       .primitive = ",'extensions':{'ACME_a':{'b':'c'}}"},
      {{"primitive.extensions that may name accessors", NULL, WARNING, "ACME_a at /meshes/0/primitives/0"},
       .primitive = ",'extensions':{'ACME_a':{'loops':[1]}}"},
      {{"NORMAL", NULL, SHAPE, NULL}, .attribute = ",'NORMAL':0"},
      {{"TANGENT", NULL, GLTF, "TANGENT"}, .attribute = ",'NORMAL':0,'TEXCOORD_0':4,'TANGENT':5"},
      {{"TANGENT without texture coordinates", NULL, WARNING, "TANGENT is left out"},
       .attribute = ",'TANGENT':5"},
      {{"TANGENT with another sign than 1", NULL, WARNING, "1 tangent has another fourth number"},
       .attribute = ",'NORMAL':0,'TEXCOORD_0':4,'TANGENT':5"},
      {{"TANGENT without NORMAL", NULL, WARNING, "TANGENT is computed anew"},
       .attribute = ",'TEXCOORD_0':4,'TANGENT':5"},
      {{"TEXCOORD_0", NULL, GLTF, "TEXCOORD_0"}, .attribute = ",'TEXCOORD_0':4"},
      {{"TEXCOORD_1", NULL, GLTF, "TEXCOORD_1"}, .attribute = ",'TEXCOORD_0':4,'TEXCOORD_1':4"},
      {{"TEXCOORD_1 alone", NULL, GLTF, "TEXCOORD_1"}, .attribute = ",'TEXCOORD_1':4"},
      {{"TEXCOORD_1 alone adds a set", NULL, WARNING, "TEXCOORD_0 is added"}, .attribute = ",'TEXCOORD_1':4"},
      {{"TEXCOORD_4", NULL, WARNING, "TEXCOORD_4 is left out"}, .attribute = ",'TEXCOORD_4':4"},
      {{"COLOR_0", NULL, GLTF, "COLOR_0"}, .attribute = ",'COLOR_0':0"},
      {{"COLOR_1", NULL, WARNING, "COLOR_1 is left out"}, .attribute = ",'COLOR_1':0"},
      {{"JOINTS_0", NULL, GLTF, "JOINTS_0"}, .attribute = ",'JOINTS_0':6,'WEIGHTS_0':6"},
      {{"an application's attribute", NULL, GLTF, "_HEAT"}, .attribute = ",'_HEAT':0"},
      {{"another attribute", NULL, WARNING, "HEAT is left out"}, .attribute = ",'HEAT':0"},
      {{"a large integer of an attribute", NULL, WARNING, "_ID is rounded where it is 16777216 or more"},
       .attribute = ",'_ID':9"},
      {{"more kinds of attributes than warnings", NULL, WARNING, "there are more warnings"},
       .attribute = TEN("A") TEN("B") TEN("C") TEN("D") TEN("E") TEN("F") TEN("G")},
      {{"targets", NULL, GLTF, "'targets':["}, .primitive = ",'targets':[{'POSITION':0}]"},
      {{"NORMAL of targets", NULL, GLTF, "'NORMAL':3}]"},
       .attribute = ",'NORMAL':0",
       .primitive = ",'targets':[{'POSITION':0,'NORMAL':0}]"},
      {{"TANGENT of targets", NULL, WARNING, "TANGENT of morph targets"},
       .primitive = ",'targets':[{'POSITION':0,'TANGENT':0}]"},
      {{"node.camera", NULL, GLTF, "'camera':0"},
       .node = ",'camera':0",
       .rest = ",'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':0.5}}]"},
      {{"the order of node.children", NULL, GLTF, "'children':[2,1]"}, .node = ",'children':[2,1]"},
      {{"node.skin", NULL, GLTF, "'skin':0"},
       .node = ",'skin':0",
       .attribute = ",'JOINTS_0':7,'WEIGHTS_0':6",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"node.matrix", NULL, GLTF, "'matrix':["}, .node = "},{'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1]"},
      {{"a matrix beside a translation", NULL, WARNING, "1 node has a matrix beside a translation"},
       .node = "},{'translation':[1,0,0],'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1]"},
      {{"a matrix that shears", NULL, WARNING, "1 node has a matrix that is more than"},
       .node = "},{'matrix':[1,0,0,0,0.5,1,0,0,0,0,1,0,7,0,0,1]"},
      {{"node.rotation", NULL, GLTF, "'rotation':[0,0,1,0]"}, .node = ",'rotation':[0,0,1,0]"},
      {{"a rotation off unit length", NULL, WARNING, "1 node has a rotation that is not of unit length"},
       .node = ",'rotation':[0,0,2,0]"},
      {{"a key off unit length", NULL, WARNING, "1 rotation key is not of unit length"},
       .channel = "},{'sampler':1,'target':{'node':1,'path':'rotation'}",
       .sampler = "},{'input':2,'output':8"},
      {{"node.scale", NULL, GLTF, "'scale':[2,2,2]"}, .node = ",'scale':[2,2,2]"},
      {{"node.translation", NULL, GLTF, "'translation':[0,0,7]"}, .node = ",'translation':[0,0,7]"},
      {{"node.skin of a mesh without joints", NULL, WARNING,
        "1 node has a skin and shows no mesh with joints"},
       .node = ",'skin':0",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"node.skin without a mesh", NULL, WARNING, "1 node has a skin and shows no mesh with joints"},
       .node = "},{'skin':0",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"node.skin of faces beside points with joints", NULL, GLTF, "'skin':0"},
       .node = ",'skin':0",
       .primitive = "},{'mode':0,'attributes':{'POSITION':0,'JOINTS_0':7,'WEIGHTS_0':5}",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"faces without joints in it", NULL, WARNING, "JOINTS_0 is joint 0 where a primitive lacks it"},
       .node = ",'skin':0",
       .primitive = "},{'mode':0,'attributes':{'POSITION':0,'JOINTS_0':7,'WEIGHTS_0':5}",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"joints that the skin has not", NULL, WARNING, "1 point names a joint that its skin has not"},
       .node = ",'skin':0",
       .attribute = ",'JOINTS_0':6,'WEIGHTS_0':7",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"inverse bind matrices of zeros", NULL, WARNING, "1 inverse bind matrix is no affine transform"},
       .rest = ",'skins':[{'joints':[1],'inverseBindMatrices':10}]"},
      {{"node.weights", NULL, GLTF, "'weights':[0.25]"},
       .node = ",'weights':[0.25]",
       .primitive = ",'targets':[{'POSITION':0}]"},
      {{"node.weights of another number", NULL, WARNING, "morph weights of 1 node"},
       .node = ",'weights':[0.25]"},
      {{"node.name", NULL, GLTF, "'name':'n'"}, .node = ",'name':'n'"},
      {{"node.name with control characters", NULL, WARNING, "1 name has control characters"},
       .node = ",'name':'a\\u0007b'"},
      {{"node.extensions", NULL, GLTF, "'ACME_a':{'b':1}"}, .node = ",'extensions':{'ACME_a':{'b':1}}"},
      {{"EXT_mesh_gpu_instancing", NULL, OBJ, "o node_0_2\n"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':3}}}"},
      {{"sampler", NULL, GLTF, "'magFilter':9729"}, .rest = ",'samplers':[{'magFilter':9729}]"},
      {{"scene", NULL, GLTF, "'scene':1"}, .rest = ",'scenes':[{'nodes':[1]},{'nodes':[0]}],'scene':1"},
      {{"a node of another scene with the same mesh", NULL, WARNING, "1 node that is not shown has a mesh"},
       .node = "},{'mesh':0",
       .rest = ",'scenes':[{'nodes':[0]},{'nodes':[1]}]"},
      {{"KHR_node_visibility", NULL, WARNING, "1 node that is not shown has a mesh"},
       .node = "},{'mesh':0,'extensions':{'KHR_node_visibility':{'visible':false}}"},
      {{"an invisible root", NULL, GLTF, "'scenes':[{'nodes':[0,1,2,3]}]"},
       .node = "},{'mesh':0,'extensions':{'KHR_node_visibility':{'visible':false}}"},
      {{"scene.name", NULL, GLTF, "'name':'s'"}, .rest = ",'scenes':[{'nodes':[0],'name':'s'}]"},
      {{"skin", NULL, GLTF, "'skeleton':1"}, .rest = ",'skins':[{'joints':[1],'skeleton':1}]"},
      {{"texture", NULL, GLTF, "'textures':[{'name':'t'}]"}, .rest = ",'textures':[{'name':'t'}]"},
      {{"a member that glTF has not", NULL, GLTF, "'more':1"}, .node = ",'more':1"},
      {{"an index that is text", NULL, WARNING, "/nodes/0/skin: left out, as this is not of the type"},
       .node = ",'skin':'0'"},
      {{"an index below 0", NULL, WARNING, "/nodes/0/skin: left out, as"}, .node = ",'skin':-1"},
      {{"an index with a fraction", NULL, WARNING, "/scene: left out, as"}, .rest = ",'scene':0.5"},
      {{"indices that are none", NULL, WARNING, "/nodes/0/children: left out, as"},
       .node = ",'children':[1,'a']"},
      {{"a number in place of three", NULL, WARNING, "/nodes/0/scale: left out, as"}, .node = ",'scale':5"},
      {{"weights that are text", NULL, WARNING, "/meshes/0/weights: left out, as"},
       .mesh = ",'weights':['a']"},
      {{"a word that is a number", NULL, WARNING, "/animations/0/samplers/0/interpolation: left out, as"},
       .sampler = ",'interpolation':5"},
      {{"a target whose accessor is text", NULL, WARNING, "/meshes/0/primitives/0/targets: left out, as"},
       .primitive = ",'targets':[{'POSITION':'0'}]"},
      {{"a member twice", NULL, WARNING, "1 member of an object stands twice"},
       .node = ",'name':'a','name':'b'"},
      {{"a name that is a number", NULL, WARNING, "/nodes/0/name: left out, as"}, .node = ",'name':5"},
      {{"extensions of a node that are none", NULL, WARNING, "/nodes/0/extensions: left out, as"},
       .node = ",'extensions':[]"},
      {{"extensions of a material that are none", NULL, WARNING, "/materials/1/extensions: left out, as"},
       .rest = ",'materials':[{},{'extensions':5}]"},
      {{"extensionsUsed that are none", NULL, WARNING, "/extensionsUsed: left out, as"},
       .rest = ",'extensionsUsed':[5]"},
      {{"two members of another type", NULL, WARNING, "gives it, as at 1 more place"},
       .node = ",'skin':'0','scale':5"},
      {{"VRMC_vrm that is no object", NULL, WARNING, "/extensions/VRMC_vrm: this is not as"},
       .rest = ",'extensions':{'VRMC_vrm':5}"},
      {{"VRMC_vrm without bones", NULL, WARNING, "/extensions/VRMC_vrm: this is not as"},
       .rest = ",'extensions':{'VRMC_vrm':{'specVersion':'1.0'}}"},
      {{"VRMC_vrm of a version to come", NULL, WARNING, "another version than VRM 1.0"},
       .rest =
           ",'extensions':{'VRMC_vrm':{'specVersion':'2.0','humanoid':{'humanBones':{'hips':{'node':1}}}}}"},
      {{"VRM whose map is none", NULL, WARNING, "/extensions/VRM: this is not as"},
       .rest = ",'extensions':{'VRM':{'humanoid':5}}"},
      {{"EXT_mesh_gpu_instancing without attributes", NULL, WARNING,
        "/nodes/0/extensions/EXT_mesh_gpu_instancing: this is not as"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{}}"},
      {{"EXT_mesh_gpu_instancing of another type", NULL, WARNING,
        "/nodes/0/extensions/EXT_mesh_gpu_instancing: this is not as"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':5}}}"},
      {{"EXT_mesh_gpu_instancing of other counts", NULL, WARNING,
        "/nodes/0/extensions/EXT_mesh_gpu_instancing: this is not as"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':3,'SCALE':0}}}"},
      {{"FB_ngon_encoding that is no object", NULL, WARNING,
        "/meshes/0/primitives/0/extensions/FB_ngon_encoding: this is not as"},
       .primitive = ",'extensions':{'FB_ngon_encoding':5}"},
      {{"KHR_animation_pointer without a pointer", NULL, WARNING,
        "/animations/0/channels/1/target/extensions/KHR_animation_pointer: this is not as"},
       .channel = "},{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{}}}"},
      {{"KHR_animation_pointer to no node", NULL, WARNING, "KHR_animation_pointer/pointer: this is not as"},
       .channel = "},{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{"
                  "'pointer':'/nodes/9/rotation'}}}"},
      {{"extras.tweend that is no object", NULL, WARNING, "/meshes/0/extras/tweend: left out"},
       .mesh = ",'extras':{'tweend':5}"}};
  static const gltf_row nothing = {0};
  char text[4096], plain[4096];
  write_gltf(plain, &nothing);
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    write_gltf(text, &rows[i]);
    assert_told(*state, "model/gltf+json", &rows[i].row, text, strlen(text), plain, strlen(plain));
  }
}

/* What nothing names, and bytes and vertices that nothing has. */
TEST_WITH(gltf_tells_of_what_nothing_names, loopback_setup, loopback_teardown) {
  static const struct {
    row row;
    const char *view_size, *points, *attribute, *accessor, *view;
  } rows[] = {
      {{"an accessor of no name", NULL, WARNING, "1 accessor is left out: nothing that is read names it"},
       "48",
       "3",
       "",
       ",{'bufferView':0,'componentType':5126,'count':1,'type':'SCALAR'}",
       ""},
      {{"a buffer view of no name", NULL, WARNING,
        "1 buffer view is left out: nothing that is read names it"},
       "48",
       "3",
       "",
       "",
       ",{'buffer':0,'byteLength':4}"},
      {{"a vertex of no face", NULL, WARNING, "1 vertex is in no face: answers leave it out"},
       "48",
       "4",
       "",
       "",
       ""},
      {{"bytes of no buffer view", NULL, WARNING, "10 bytes of buffers are left out"}, "36", "3", "", "", ""},
      {{"NORMAL off unit length", NULL, WARNING, "1 normal or tangent is not of unit length"},
       "48",
       "3",
       ",'NORMAL':2",
       ",{'bufferView':0,'byteOffset':12,'componentType':5126,'count':3,'type':'VEC3'}",
       ""}};
  char texts[2][1024];
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    for (int k = 0; k < 2; k++) {
      bool has_it = k == 1;
      snprintf(texts[k], sizeof texts[k],
               "{'asset':{'version':'2.0'},'buffers':[{'byteLength':52,'uri':'data:application/octet-stream;"
               "base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAQQQAAEEEAABBBAAECAA=='}],"
               "'bufferViews':[{'buffer':0,'byteLength':%s},{'buffer':0,'byteOffset':48,'byteLength':3}%s],"
               "'accessors':[{'bufferView':0,'componentType':5126,'count':%s,'type':'VEC3'},{'bufferView':1,"
               "'componentType':5121,'count':3,'type':'SCALAR'}%s],'meshes':[{'primitives':[{'attributes':{"
               "'POSITION':0%s},'indices':1}]}],'nodes':[{'mesh':0}]}",
               has_it ? rows[i].view_size : "48", has_it ? rows[i].view : "", has_it ? rows[i].points : "3",
               has_it ? rows[i].accessor : "", has_it ? rows[i].attribute : "");
      quote(texts[k]);
    }
    assert_told(*state, "model/gltf+json", &rows[i].row, texts[1], strlen(texts[1]), texts[0],
                strlen(texts[0]));
  }
}

/* KHR_node_visibility: a node that is not visible hides all below it. */
TEST_WITH(obj_is_without_invisible_nodes, loopback_setup, loopback_teardown) {
  char text[4096];
  const gltf_row hidden = {
      .node =
          "},{'children':[2],'extensions':{'KHR_node_visibility':{'visible':false}}},{'mesh':0,'name':'a'},{"
          "'mesh':0,'name':'b','extensions':{'KHR_node_visibility':{'visible':true}}"};
  write_gltf(text, &hidden);
  reply r = loopback_ask(*state, "POST", "/v1/surface.obj?level=0", "Content-Type: model/gltf+json\n", text,
                         strlen(text));
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(r.body, "o b\n"));
  assert_null(strstr(r.body, "o a\n"));
  reply_free(&r);
}

TEST_WITH(bytes_behind_the_buffer_of_a_glb_are_told, loopback_setup, loopback_teardown) {
  static const char json[] =
      "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":36}],\"bufferViews\":[{\"buffer\":0,"
      "\"byteLength\":36}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":"
      "\"VEC3\"}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}]}";
  static const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  for (uint32_t more = 3; more < 6; more += 2) {
    uint8_t glb[512] = {0};
    uint32_t json_size = (sizeof json - 1 + 3) / 4 * 4, bin_size = sizeof triangle + (more + 3) / 4 * 4,
             size = 28 + json_size + bin_size;
    const uint32_t head[5] = {0x46546C67, 2, size, json_size, 0x4E4F534A}, bin[2] = {bin_size, 0x004E4942};
    memcpy(glb, head, sizeof head);
    memset(glb + 20, ' ', json_size);
    memcpy(glb + 20, json, sizeof json - 1);
    memcpy(glb + 20 + json_size, bin, sizeof bin);
    memcpy(glb + 28 + json_size, triangle, sizeof triangle);
    const row one = {"bytes of the BIN chunk", NULL, WARNING, "8 bytes of the BIN chunk are left out"};
    reply r = ask(*state, "model/gltf-binary", glb, size, one.where);
    assert_int_equal(r.status, 201);
    assert_int_equal(shows(&r, NULL, &one), more > 3);
    reply_free(&r);
  }
}

/* What nodes alone cannot show is told, and names no accessor that is not there. */
TEST_WITH(tracks_of_what_is_no_node_go_with_the_meshes, loopback_setup, loopback_teardown) {
  char text[4096];
  const gltf_row pointed = {
      .channel = "},{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{"
                 "'pointer':'/materials/0/emissiveFactor'}}}",
      .rest = ",'materials':[{}]"};
  write_gltf(text, &pointed);
  for (int bare = 0; bare < 2; bare++) {
    reply r = loopback_ask(*state, "POST", bare ? "/v1/surface.gltf?meshes=none" : "/v1/surface.gltf",
                           "Content-Type: model/gltf+json\n", text, strlen(text));
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    assert_int_equal(r.status, 200);
    assert_int_equal(strstr(r.body, "emissiveFactor") == NULL, bare);
    assert_int_equal(warning && strstr(warning, "meshes%3Dnone%20keeps%20tracks"), bare);
    reply_free(&r);
  }
}

/* A VRM names meshes, and nodes that show them, by numbers. */
TEST_WITH(baking_tells_that_a_vrm_means_other_meshes, loopback_setup, loopback_teardown) {
  static const gltf_row row = {.attribute = ",'JOINTS_0':7,'WEIGHTS_0':5",
                               .node = ",'skin':0",
                               .rest = ",'skins':[{'joints':[1]}],'extensions':{'VRM':{'humanoid':{"
                                       "'humanBones':[{'bone':'hips','node':1}]}}}"};
  char text[4096];
  write_gltf(text, &row);
  for (int baked = 0; baked < 2; baked++) {
    reply r =
        loopback_ask(*state, "POST", baked ? "/v1/surface.gltf?skin=bake&at=0" : "/v1/surface.gltf?clip=none",
                     "Content-Type: model/gltf+json\n", text, strlen(text));
    assert_int_equal(r.status, 200);
    const char *warning = reply_header(&r, "X-Tweend-Warning");
    assert_int_equal(warning && strstr(warning, "what%20VRM%20says"), baked);
    reply_free(&r);
  }
}

/* Points that follow a joint: their node keeps its skin, and skin=bake says that it moves faces alone. */
TEST_WITH(points_and_lines_keep_their_skin, loopback_setup, loopback_teardown) {
  char *text = quoted(
      "{'asset':{'version':'2.0'},'accessors':[{'componentType':5126,'count':4,'type':'VEC3','min':[0,0,0],"
      "'max':[0,0,0]},{'componentType':5121,'count':4,'type':'VEC4'},{'componentType':5126,'count':4,'type':"
      "'VEC4'}],'meshes':[{'primitives':[{'mode':0,'attributes':{'POSITION':0,'JOINTS_0':1,'WEIGHTS_0':2}}]}]"
      ","
      "'nodes':[{'mesh':0,'skin':0},{}],'skins':[{'joints':[1]}]}");
  reply r = loopback_ask(*state, "POST", "/v1/surface.gltf?level=0", "Content-Type: model/gltf+json\n", text,
                         strlen(text));
  assert_int_equal(r.status, 200);
  assert_true(says(r.body, "'mesh':0,'skin':0"));
  assert_null(reply_header(&r, "X-Tweend-Warning"));
  reply_free(&r);
  r = loopback_ask(*state, "POST", "/v1/surface.gltf?level=0&skin=bake&clip=none",
                   "Content-Type: model/gltf+json\n", text, strlen(text));
  assert_int_equal(r.status, 200);
  assert_non_null(strstr(reply_header(&r, "X-Tweend-Warning"), "points%20and%20lines%20rest"));
  reply_free(&r);
  free(text);
}
