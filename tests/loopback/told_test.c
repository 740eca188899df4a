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
  const char *construct;
  place where;
  const char *shown; /* with ' in place of "; NULL from SHAPE on */
} row;

/* A row with its file, likewise, in which '@' stands for the plain file. */
typedef struct text_row {
  const char *construct;
  place where;
  const char *shown, *text;
} text_row;

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

static void assert_all_told(loopback *loop, const char *type, const char *plain, const text_row *rows,
                            size_t count) {
  char *without = quoted(plain);
  for (size_t i = 0; i < count; i++) {
    char text[4096];
    const char *at = strchr(rows[i].text, '@');
    snprintf(text, sizeof text, "%.*s%s%s", (int)(at ? at - rows[i].text : 0), rows[i].text, at ? plain : "",
             at ? at + 1 : rows[i].text);
    quote(text);
    const row one = {rows[i].construct, rows[i].where, rows[i].shown};
    assert_told(loop, type, &one, text, strlen(text), without, strlen(without));
  }
  free(without);
}

/* ---- OBJ: appendix B1 of Wavefront's manual, and what tools added ---------------------------- */

#define FOLD "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n"

TEST_WITH(obj_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
  static const text_row rows[] = {
      {"v w", WARNING, "weight of a point", "@v 5 5 5 2\nf 1 2 5\n"},
      {"v r g b", GLTF, "COLOR_0", "v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"v r g b a", WARNING, "alpha of a colour", "v 0 0 0 1 0 0 0.5\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"v r g b in bytes", WARNING, "divided by 255", "v 0 0 0 255 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"v r g b beyond 1", WARNING, "brought into 0 to 1", "v 0 0 0 2.5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"v with more", WARNING, "behind its colour", "v 0 0 0 1 0 0 1 9\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
      {"a comment", COMMENT, NULL, "# by hand\n@"},
      {"#MRGB", GLTF, "COLOR_0", "@#MRGB ffff0000ff00ff00ff0000ffffffffff\n"},
      {"#MRGB with a mask", WARNING, "1 mask of a point", "@#MRGB 80ff0000ff00ff00ff0000ffffffffff\n"},
      {"#MRGB of more points", WARNING, "colours (#MRGB) is not read to its end",
       "#MRGB ffff0000ff00ff00ff0000ffffffffffffffffff\n@"},
      {"#MRGB that is none", WARNING, "colours (#MRGB) is not read to its end", "@#MRGB ffff00zz\n"},
      {"a point of no face", WARNING, "point is in no face", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n"},
      {"vt u v", OBJ, "vt 0.25 0.75", "vt 0.25 0.75\n@f 1/1 2/1 4/1\n"},
      {"vt of no corner", WARNING, "1 texture coordinate of no corner", "vt 0.25 0.75\n@"},
      {"vt u v w", WARNING, "third texture coordinate", "vt 0.25 0.75 0.5\n@f 1/1 2/1 4/1\n"},
      {"vt without v", WARNING, "the file has no vt", "@f 1/1 2/1 4/1\n"},
      {"vt of some corners", WARNING, "get 0 0", "vt 0.25 0.75\n@f 1/1 2 4\n"},
      {"vn", OBJ, "vn 0.6 0.8 0", "vn 0.6 0.8 0\n@f 1//1 2//1 4//1\n"},
      {"vn of another length", OBJ, "vn 0 0.6 0.8", "vn 0 3 4\n@f 1//1 2//1 4//1\n"},
      {"vn of no corner", WARNING, "1 normal of no corner", "vn 0 0 1\n@"},
      {"vn of no length", WARNING, "1 normal is 0 0 0", "vn 0 0 0\n@f 1//1 2//1 4//1\n"},
      {"vn that is none", WARNING, "normal is left out", "vn nan 0 0\n@"},
      {"vn without v", WARNING, "the file has no vn", "@f 1//1 2//1 4//1\n"},
      {"f of two corners", WARNING, "fewer than three", "@f 1 2\n"},
      {"f with a corner twice", WARNING, "2 edges have one face on both sides",
       "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3 2 4\n"},
      {"f with a doubled corner", WARNING, "twice in a row", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2 3\n"},
      {"fo", SHAPE, NULL, "v 0 0 0\nv 1 0 0\nv 0 1 0\nfo 1 2 3\n"},
      {"o", OBJ, "o part\n", "o part\n@"},
      {"o that shares points", WARNING, "object is one mesh", "o a\n@o b\nf 2 3 4\n"},
      {"faces before the first o", MODEL, "'name':'b','vertices':3,",
       "@v 5 0 0\nv 6 0 0\nv 5 1 0\no b\nf -1 -2 -3\n"},
      {"o without faces", WARNING, "object without faces", "o a\no b\n@"},
      {"g", GLTF, "['left','right']", "g left right\n@"},
      {"g without faces", WARNING, "1 set of groups without faces", "o a\ng idle\ng used\n@"},
      {"g with faces further on", GLTF, "['used']", "o a\ng used\n# none\ng default\n@g used\nf 2 3 4\n"},
      {"s", HARD, NULL, "s off\n@"},
      {"s of two numbers", WARNING, "1 further smoothing group", "s 1 2\n@"},
      {"s with a fraction", WARNING, "smoothing group is left out", "s 1.5\n@"},
      {"s of no number", WARNING, "smoothing group is left out", "s all\n@"},
      {"usemtl", GLTF, "'name':'red'", "usemtl red\n@"},
      {"mtllib", WARNING, "libraries of materials", "mtllib a.mtl\n@"},
      {"mtllib and usemtl", WARNING, "the name alone is kept", "mtllib a.mtl\nusemtl red\n@"},
      {"t crease", OBJ, "t crease", "@t crease 2/1/0 0 1 2.5\n"},
      {"t corner", OBJ, "t corner", "@t corner 1/1/0 0 2\n"},
      {"t hole", SHAPE, NULL, "@t hole 1/0/0 0\n"},
      {"t creasemethod", OBJ, "t creasemethod", "@t crease 2/1/0 0 1 2\nt creasemethod 0/0/1 chaikin\n"},
      {"t interpolateboundary", OBJ, "t interpolateboundary 1/0/0 2", "@t interpolateboundary 1/0/0 2\n"},
      {"t facevaryinginterpolateboundary", OBJ, "t facevaryinginterpolateboundary",
       "vt 0 0\n@f 1/1 2/1 4/1\nt facevaryinginterpolateboundary 1/0/0 5\n"},
      {"t smoothtriangles", OBJ, "t smoothtriangles", "@t smoothtriangles 0/0/1 smooth\n"},
      {"t with numbers behind its own", WARNING, "1 subdivision tag has values", "@t crease 2/1/0 0 1 2 3\n"},
      {"t with words behind its own", WARNING, "1 subdivision tag has values", "@t corner 1/1/1 0 2 a\n"},
      {"t with floats of no use", WARNING, "1 subdivision tag has values", "@t hole 1/1/0 0 5\n"},
      {"t with integers of no use", WARNING, "1 subdivision tag has values",
       "@t creasemethod 1/0/1 7 chaikin\n"},
      {"t with two strings", WARNING, "1 subdivision tag has values",
       "@t creasemethod 0/0/2 chaikin normal\n"},
      {"t crease with two values an edge", WARNING, "1 subdivision tag has values",
       "@t crease 2/2/0 0 1 2 3\n"},
      {"t with a sharpness below 0", WARNING, "1 crease or corner has a sharpness below 0",
       "@t corner 1/1/0 0 -2\n"},
      {"t with another number before", WARNING, "1 subdivision tag takes the place",
       "@t interpolateboundary 1/0/0 1\nt interpolateboundary 1/0/0 2\n"},
      {"t with another word before", WARNING, "1 subdivision tag takes the place",
       "@t smoothtriangles 0/0/1 smooth\nt smoothtriangles 0/0/1 catmark\n"},
      {"t with the same number before", WARNING, "1 subdivision tag says what another one has said",
       "@t interpolateboundary 1/0/0 2\nt interpolateboundary 1/0/0 2\n"},
      {"t crease that stands twice", WARNING, "1 crease, corner or hole is listed again",
       "@t crease 2/1/0 0 1 2\nt crease 2/1/0 1 0 2\n"},
      {"t corner and t hole that stand twice", WARNING, "2 creases, corners or holes are listed again",
       "@t corner 2/1/0 0 0 2\nt hole 2/0/0 0 0\n"},
      {"a name in Latin-1", WARNING, "1 name is not UTF-8", "o caf\xE9\n@"},
      {"names in Latin-1", WARNING, "2 names are not UTF-8", "o a\nusemtl caf\xE9\ng caf\xE9\n@"},
      {"a name with control characters", WARNING, "1 name has control characters", "usemtl a\x07z\n@"},
      {"t of another name", WARNING, "subdivision tag", "@t vertexedit 1/1/1 0 1 a\n"},
      {"another statement", WARNING, "none that is known", "@pose 1\n"}};
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
      const text_row one = {word, WARNING, ignored[i][0], text};
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
  static const text_row rows[] = {
      {"comment", COMMENT, NULL, PLY_HEAD "comment by hand\n" REST PLY_END ROWS},
      {"another version", WARNING, "words that are left out", "ply\nformat ascii 2.0\n" REST PLY_END ROWS},
      {"a second format", WARNING, "line of the header", PLY_HEAD "format ascii 1.0\n" REST PLY_END ROWS},
      {"words behind a line", WARNING, "words that are left out", PLY_HEAD REST "end_header now\n" ROWS},
      {"comment TextureFile", WARNING, "line of the header",
       PLY_HEAD "comment TextureFile a.png\n" REST PLY_END ROWS},
      {"obj_info", WARNING, "line of the header", PLY_HEAD "obj_info by hand\n" REST PLY_END ROWS},
      {"another line", WARNING, "line of the header", PLY_HEAD "units mm\n" REST PLY_END ROWS},
      {"another element", WARNING, "left out: edge",
       PLY_HEAD REST "element edge 1\nproperty int a\n" PLY_END ROWS "1\n"},
      {"a second element vertex", WARNING, "left out: vertex",
       PLY_HEAD REST "element vertex 1\nproperty int x\n" PLY_END ROWS "1\n"},
      {"normals", SHAPE, NULL, VERTEX("property float nx\nproperty float ny\nproperty float nz\n", "1 0 0")},
      {"a normal that is none", WARNING, "normals are left out",
       VERTEX("property float nx\nproperty float ny\nproperty float nz\n", "nan 0 0")},
      {"normals of no length", WARNING, "3 normals are 0 0 0",
       VERTEX("property float nx\nproperty float ny\nproperty float nz\n", "0 0 0")},
      {"a part of normals", WARNING, "vertex.nx", VERTEX("property float nx\n", "1")},
      {"colours", GLTF, "COLOR_0", VERTEX(RGB, "255 0 0")},
      {"alpha", GLTF, "COLOR_0", VERTEX(RGB "property uchar alpha\n", "255 0 0 9")},
      {"a part of colours", WARNING, "vertex.red", VERTEX("property uchar red\n", "255")},
      {"texture coordinates", OBJ, "vt 0.25 0.5", VERTEX("property float s\nproperty float t\n", "0.25 0.5")},
      {"texture coordinates that are none", WARNING, "3 texture coordinates are 0 0",
       VERTEX("property float s\nproperty float t\n", "nan 0.5")},
      {"a part of them", WARNING, "vertex.u", VERTEX("property float u\n", "0.25")},
      {"another property", WARNING, "vertex.quality", VERTEX("property float quality\n", "1")},
      {"a list of vertices", WARNING, "vertex.near", VERTEX("property list uchar int near\n", "1 2")},
      {"colours of faces", GLTF, "COLOR_0", FACE(RGB, "255 0 0")},
      {"texcoord", OBJ, "vt 0.25 0.5", FACE("property list uchar float texcoord\n", "6 0 0 0.25 0.5 0 1")},
      {"texcoord of other numbers", WARNING, "texture coordinates 0 0",
       FACE("property list uchar float texcoord\n", "2 0 0")},
      {"texnumber", WARNING, "face.texnumber", FACE("property int texnumber\n", "1")},
      {"tristrips", MODEL, "'faces':2,",
       PLY_HEAD PLY_XYZ("4") "element tristrips 1\nproperty list int int vertex_indices\n" PLY_END
                             "0 0 0\n1 0 0\n0 1 0\n1 1 0\n4 0 1 2 3\n"},
      {"tristrips of two corners", WARNING, "2 strips have fewer than three corners",
       PLY_HEAD PLY_XYZ("4") "element tristrips 1\nproperty list int int vertex_indices\n" PLY_END
                             "0 0 0\n1 0 0\n0 1 0\n1 1 0\n9 3 2 -1 0 1 2 3 -1 1\n"},
      {"faces without corners", WARNING, "left out: face",
       PLY_HEAD PLY_XYZ("3") "element face 1\nproperty int a\n" PLY_END "0 0 0\n1 0 0\n0 1 0\n7\n"},
      {"a point of no face", WARNING, "point is in no face",
       PLY_HEAD PLY_XYZ("4") PLY_FACE PLY_END "0 0 0\n1 0 0\n0 1 0\n9 9 9\n3 0 1 2\n"},
      {"a doubled corner", WARNING, "twice in a row",
       PLY_HEAD PLY_XYZ("3") PLY_FACE PLY_END "0 0 0\n1 0 0\n0 1 0\n4 0 1 1 2\n"},
      {"more numbers in a line", WARNING, "1 line has more numbers than its row, in line 10",
       PLY_HEAD PLY_XYZ("3") PLY_FACE PLY_END "0 0 0 1\n0 0\n0 1 0\n3 0 1 2\n"},
      {"bytes behind", WARNING, "behind the last element", PLY_HEAD REST PLY_END ROWS "more"}};
  assert_all_told(*state, "model/ply", plain, rows, sizeof rows / sizeof *rows);
}

/* ---- STL ------------------------------------------------------------------------------------- */

TEST_WITH(text_of_stl_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
#define FACET(normal)                                                                                        \
  "facet normal " normal "\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
  static const text_row rows[] = {
      {"the name of a solid", MODEL, "'name':'part'", "solid part\n" FACET("0 0 1") "endsolid\n"},
      {"a name in Latin-1", WARNING, "1 name is not UTF-8", "solid caf\xE9\n" FACET("0 0 1") "endsolid\n"},
      {"a name with control characters", WARNING, "1 name has control characters",
       "solid a\x07z\n" FACET("0 0 1") "endsolid\n"},
      {"a byte order mark", COMMENT, NULL, "\xEF\xBB\xBF@"},
      {"a second solid", WARNING, "solid is one mesh with the first",
       "solid\n" FACET("0 0 1") "endsolid\nsolid\nendsolid\n"},
      {"a normal against the corners", WARNING, "against the order", "solid\n" FACET("0 0 -1") "endsolid\n"},
      {"a normal that is none", WARNING, "no three finite numbers", "solid\n" FACET("nan 0 0") "endsolid\n"},
      {"a normal of two numbers", WARNING, "no three finite numbers", "solid\n" FACET("0 0") "endsolid\n"},
      {"another name at its end", WARNING, "name behind endsolid", "solid a\n" FACET("0 0 1") "endsolid b\n"},
      {"the name again at its end", COMMENT, NULL, "solid\n" FACET("0 0 1") "endsolid\n"},
      {"a loop of four", SHAPE, NULL,
       "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\n"
       "vertex 0 1 0\nendloop\nendfacet\nendsolid\n"},
      {"another word", WARNING, "words are left out", "solid\n" FACET("0 0 1") "color 1 0 0\nendsolid\n"}};
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
      {{"VisCAM's colour", GLTF, "COLOR_0"}, "", 0x801F, "", 1},
      {{"Magics' colour", GLTF, "COLOR_0"}, "COLOR=abcd", 0x001F, "", 1},
      {{"Magics' material", WARNING, "material of the header"}, "COLOR=abcd,MATERIAL=abcdefghijkl", 0, "", 1},
      {{"units in the header", WARNING, "header is left out: \\'units: mm\\'"}, "units: mm", 0, "", 1},
      {{"units beside a colour", WARNING, "header is left out: \\'unit mm\\'"},
       "unit mm, COLOR=abcd",
       0,
       "",
       1},
      {{"who wrote it, in the header", COMMENT, NULL}, "written by Unity, by hand", 0, "", 1},
      {{"blanks in the header", COMMENT, NULL}, "  \t ", 0, "", 1},
      {{"another attribute", WARNING, "attributes that are left out"}, "", 7, "", 1},
      {{"bytes of an attribute", WARNING, "attributes that are left out"}, "", 4, "abcd", 1},
      {{"bytes behind", WARNING, "bytes behind the facets"}, "", 0, "abcd", 1},
      {{"facets behind", WARNING, "behind those that the file counts"}, "", 0, "", 3}};
  uint8_t body[400], plain[400];
  size_t plain_size = binary_facet(plain, "", 0, "", 1);
  for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
    size_t size = binary_facet(body, rows[i].header, rows[i].attribute, rows[i].behind, rows[i].facets);
    assert_told(*state, "model/stl", &rows[i].row, body, size, plain, plain_size);
  }
}

TEST_WITH(normals_of_binary_stl_that_are_none_are_told, loopback_setup, loopback_teardown) {
  uint8_t body[400];
  size_t size = binary_facet(body, "", 0, "", 1);
  const float none = NAN;
  memcpy(body + 84, &none, sizeof none);
  const row one = {"a normal that is none", WARNING, "1 normal of a facet is no three finite numbers"};
  reply r = ask(*state, "model/stl", body, size, one.where);
  assert_true(shows(&r, NULL, &one));
  reply_free(&r);
}

TEST_WITH(attributes_beside_colours_are_told, loopback_setup, loopback_teardown) {
  uint8_t body[400];
  size_t size = binary_facet(body, "", 0x801F, "", 2);
  body[80] = 2;
  body[84 + 50 + 48] = 7;
  body[84 + 50 + 49] = 0;
  const row one = {"an attribute", WARNING, "1 facet has attributes"};
  reply r = ask(*state, "model/stl", body, size, one.where);
  assert_true(shows(&r, NULL, &one));
  reply_free(&r);
}

/* ---- BVH ------------------------------------------------------------------------------------- */

TEST_WITH(bvh_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
#define JOINT(offset, channels, end)                                                                         \
  "HIERARCHY\nROOT hip\n{\n" offset "CHANNELS " channels "\nEnd Site" end "\n{\nOFFSET 0 1 0\n}\n}\n"
#define FRAMES(count) "MOTION\nFrames: " count "\nFrame Time: 0.5\n"
  static const text_row rows[] = {
      {"OFFSET", MODEL, "[0,7,0]", JOINT("OFFSET 0 7 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n"},
      {"a second OFFSET", WARNING, "OFFSET takes the place",
       JOINT("OFFSET 0 1 0\nOFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n"},
      {"a channel of scale", WARNING, "channel of scale is left out",
       JOINT("OFFSET 0 2 0\n", "2 Zrotation Xscale", "") FRAMES("2") "0 1\n90 1\n"},
      {"a name in Latin-1", WARNING, "1 name is not UTF-8",
       "HIERARCHY\nROOT h\xFC"
       "fte\n{\nOFFSET 0 2 0\nCHANNELS 0\n}\n" FRAMES("0")},
      {"the name of an End Site", WARNING, "1 name of an end site",
       JOINT("OFFSET 0 2 0\n", "1 Zrotation", " tip") FRAMES("2") "0\n90\n"},
      {"Frames of another number", WARNING, "Frames: says 9",
       JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("9") "0\n90\n"},
      {"no frames", WARNING, "MOTION has no frame", JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("0")},
      {"no MOTION", WARNING, "there is no MOTION", JOINT("OFFSET 0 2 0\n", "1 Zrotation", "")},
      {"a comma", WARNING, "a comma", JOINT("OFFSET 0 2,5 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n"},
      {"Frame Time", MODEL, "'duration':1,",
       JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("3") "0\n90\n0\n"},
      {"position channels", GLTF, "'path':'translation'",
       JOINT("OFFSET 0 2 0\n", "1 Zposition", "") FRAMES("2") "0\n9\n"}};
  assert_all_told(*state, "application/octet-stream",
                  JOINT("OFFSET 0 2 0\n", "1 Zrotation", "") FRAMES("2") "0\n90\n", rows,
                  sizeof rows / sizeof *rows);
}

/* ---- tweend JSON: a member is read or refused ------------------------------------------------ */

TEST_WITH(tweend_json_loses_nothing_in_silence, loopback_setup, loopback_teardown) {
#define MESH "'positions':[[0,0,0],[1,0,0],[0,1,0],[0,0,1]],'faces':[[0,1,2],[0,2,3]]"
#define CLIP(track)                                                                                          \
  "{'meshes':[{" MESH "}],'nodes':[{'name':'n'}],'clips':[{'name':'c','tracks':[{'node':'n'," track "}]}]}"
  static const text_row rows[] = {
      {"name of a mesh", MODEL, "'name':'m'", "{'meshes':[{'name':'m'," MESH "}]}"},
      {"uvs", OBJ, "vt 0.25 0.5", "{'meshes':[{" MESH ",'uvs':[[0.25,0.5],[1,0],[0,1],[1,1]]}]}"},
      {"face_uvs", OBJ, "vt 0.25 0.5",
       "{'meshes':[{" MESH ",'uvs':[[0.25,0.5]],'face_uvs':[[0,0,0],[0,0,0]]}]}"},
      {"uvs of no corner", WARNING, "1 texture coordinate of no corner",
       "{'meshes':[{" MESH ",'uvs':[[0.25,0.5],[0,0]],'face_uvs':[[0,0,0],[0,0,0]]}]}"},
      {"creases", OBJ, "t crease", "{'meshes':[{" MESH ",'creases':[{'edge':[0,1],'sharpness':2.5}]}]}"},
      {"corners", OBJ, "t corner", "{'meshes':[{" MESH ",'corners':[{'vertex':0,'sharpness':2}]}]}"},
      {"holes", SHAPE, NULL, "{'meshes':[{" MESH ",'holes':[1]}]}"},
      {"shape", MODEL, "'faces':6,", "{'meshes':[{'shape':{'kind':'box'}}]}"},
      {"edits", MODEL, "'faces':6,",
       "{'meshes':[{" MESH ",'edits':[{'edit':'extrude','faces':'all','distance':1}]}]}"},
      {"nodes", MODEL, "'name':'n'", "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'name':'n','mesh':'m'}]}"},
      {"parent", MODEL, "'parent':'n'",
       "{'nodes':[{'name':'n'},{'name':'p','parent':'n'}],'meshes':[{" MESH "}]}"},
      {"translation", OBJ, "v 0 0 7",
       "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','translation':[0,0,7]}]}"},
      {"rotation", OBJ, "v -1 0 0",
       "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','rotation':[0,0,1,0]}]}"},
      {"a point of no face", WARNING, "1 point is in no face",
       "{'meshes':[{'positions':[[0,0,0],[1,0,0],[0,1,0],[9,9,9]],'faces':[[0,1,2]]}]}"},
      {"a mesh of no node", WARNING, "1 mesh is in no node",
       "{'meshes':[{'name':'m'," MESH "},{'name':'q'," MESH "}],'nodes':[{'mesh':'m'}]}"},
      {"rotation off unit length", WARNING, "1 node has a rotation",
       "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','rotation':[0,0,0,2]}]}"},
      {"a clip without tracks", WARNING, "1 clip has no tracks",
       "{'meshes':[{" MESH "}],'clips':[{'name':'c','tracks':[]}]}"},
      {"scale", OBJ, "v 7 0 0", "{'meshes':[{'name':'m'," MESH "}],'nodes':[{'mesh':'m','scale':[7,1,1]}]}"},
      {"quaternions", MODEL, "'name':'c'",
       CLIP("'path':'rotation','times':[0,1],'quaternions':[[0,0,0,1],[0,0,1,0]]")},
      {"values", GLTF, "STEP",
       CLIP("'path':'translation','interpolation':'step','times':[0,1],'values':[[0,0,0],[1,0,0]]")}};
  assert_all_told(*state, "application/json", "{'meshes':[{" MESH "}]}", rows, sizeof rows / sizeof *rows);
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
      {{"accessor.name", WARNING, "unknown members of 1"}, .accessor = ",'name':'a'"},
      {{"accessor.extras", WARNING, "unknown members of 1"}, .accessor = ",'extras':1"},
      {{"accessor.sparse", SHAPE, NULL},
       .accessor = ",'sparse':{'count':1,'indices':{'bufferView':1,'byteOffset':2,'componentType':5123},"
                   "'values':{'bufferView':3,'byteOffset':12}}"},
      {{"animation.name", GLTF, "'name':'walk'"}, .animation = ",'name':'walk'"},
      {{"animation without channels", WARNING, "1 clip has no tracks"},
       .animation = "},{'channels':[],'samplers':[]"},
      {{"animation.extras", GLTF, "'extras':{'a':1}"}, .animation = ",'extras':{'a':1}"},
      {{"channel.extras", GLTF, "'extras':{'c':1}"}, .channel = ",'extras':{'c':1}"},
      {{"target.extras", GLTF, "'extras':{'t':1}"}, .target = ",'extras':{'t':1}"},
      {{"sampler.interpolation", GLTF, "'interpolation':'STEP'"}, .sampler = ",'interpolation':'STEP'"},
      {{"sampler that no channel names", WARNING, "sampler of an animation"},
       .sampler = "},{'input':2,'output':3"},
      {{"asset.copyright", GLTF, "'copyright':'me'"}, .asset = ",'copyright':'me'"},
      {{"asset.extras", GLTF, "'extras':{'a':1}"}, .asset = ",'extras':{'a':1}"},
      {{"asset.generator", COMMENT, NULL}, .asset = ",'generator':'by hand'"},
      {{"buffer.name", WARNING, "unknown members of 1"}, .buffer = ",'name':'b'"},
      {{"a member that accessors have not", WARNING, "unknown members of 1"}, .accessor = ",'more':1"},
      {{"sparse.extras", WARNING, "unknown members of 1"},
       .accessor = ",'sparse':{'count':1,'indices':{'bufferView':1,'byteOffset':2,'componentType':5123},"
                   "'values':{'bufferView':3,'byteOffset':12},'extras':1}"},
      {{"buffer that nothing reads", WARNING, "nothing that is read lies in it"},
       .buffer = "},{'byteLength':5,'uri':'absent.bin'"},
      {{"bufferView.name", WARNING, "unknown members of 1"}, .view = ",'name':'v'"},
      {{"camera", GLTF, "'znear':0.5"},
       .rest = ",'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':0.5}}]"},
      {{"extensionsUsed", GLTF, "'extensionsUsed':['KHR_materials_unlit']"},
       .rest = ",'extensionsUsed':['KHR_materials_unlit'],'materials':[{'extensions':{'KHR_materials_unlit':{"
               "}}}]"},
      {{"an extension that is not declared", GLTF, "'extensionsUsed':['KHR_materials_unlit']"},
       .rest = ",'materials':[{'extensions':{'KHR_materials_unlit':{}}}]"},
      {{"extensions", GLTF, "'ACME_a':{'b':1}"}, .rest = ",'extensions':{'ACME_a':{'b':1}}"},
      {{"extensions that name views", WARNING, "ACME_a at the root"},
       .rest = ",'extensions':{'ACME_a':{'bufferView':1}}"},
      {{"extras", GLTF, "'extras':{'r':1}"}, .rest = ",'extras':{'r':1}"},
      {{"image", GLTF, "'name':'picture'"},
       .rest = ",'images':[{'name':'picture','uri':'data:image/png;base64,iVBORw0KGgo='}]"},
      {{"image on the web", WARNING, "an address on the web"},
       .rest = ",'images':[{'uri':'http://a/b.png'}]"},
      {{"material", GLTF, "'doubleSided':true"}, .rest = ",'materials':[{'doubleSided':true}]"},
      {{"mesh.name", GLTF, "'name':'m'"}, .mesh = ",'name':'m'"},
      {{"mesh.weights", GLTF, "'weights':[0.5]"},
       .primitive = ",'targets':[{'POSITION':0}]",
       .mesh = ",'weights':[0.5]"},
      {{"mesh.extras", GLTF, "'extras':{'m':1}"}, .mesh = ",'extras':{'m':1}"},
      {{"mesh that no node shows", WARNING, "in no node of the shown scene"},
       .mesh = "},{'primitives':[{'attributes':{'POSITION':0},'indices':1}]"},
      {{"primitives of one material", WARNING, "becomes one with another"},
       .primitive = "},{'attributes':{'POSITION':0},'indices':1"},
      {{"primitive without POSITION", WARNING, "without POSITION"}, .primitive = "},{'attributes':{}"},
      {{"primitive.material", GLTF, "'material':0"},
       .primitive = ",'material':0",
       .rest = ",'materials':[{}]"},
      {{"primitive.mode of points", GLTF, "'mode':0"},
       .primitive = "},{'attributes':{'POSITION':0},'mode':0"},
      {{"an attribute of points with a blank", WARNING, "_a b of points and lines is left out"},
       .primitive = "},{'attributes':{'POSITION':0,'_a b':0},'mode':0"},
      {{"primitive.mode of strips", SHAPE, NULL}, .primitive = ",'mode':5"},
      {{"primitive.mode of fans", SHAPE, NULL}, .primitive = ",'mode':6"},
      {{"mesh.extensions that may name accessors", WARNING, "ACME_a at /meshes/0"},
       .mesh = ",'extensions':{'ACME_a':{'loops':[1]}}"},
      {{"KHR_xmp_json_ld", GLTF, "'KHR_xmp_json_ld':{'packet':0}"},
       .mesh = ",'extensions':{'KHR_xmp_json_ld':{'packet':0}}",
       .rest = ",'extensions':{'KHR_xmp_json_ld':{'packets':[{}]}}"},
      {{"primitive.extras", GLTF, "'extras':{'p':1}"}, .primitive = ",'extras':{'p':1}"},
      {{"primitive.extensions", GLTF, "'ACME_a':{'b':'c'}"},
       .primitive = ",'extensions':{'ACME_a':{'b':'c'}}"},
      {{"primitive.extensions that may name accessors", WARNING, "ACME_a at /meshes/0/primitives/0"},
       .primitive = ",'extensions':{'ACME_a':{'loops':[1]}}"},
      {{"NORMAL", SHAPE, NULL}, .attribute = ",'NORMAL':0"},
      {{"TANGENT", GLTF, "TANGENT"}, .attribute = ",'NORMAL':0,'TEXCOORD_0':4,'TANGENT':5"},
      {{"TANGENT without texture coordinates", WARNING, "TANGENT is left out"}, .attribute = ",'TANGENT':5"},
      {{"TANGENT with another sign than 1", WARNING, "1 tangent has another fourth number"},
       .attribute = ",'NORMAL':0,'TEXCOORD_0':4,'TANGENT':5"},
      {{"TANGENT without NORMAL", WARNING, "TANGENT is computed anew"},
       .attribute = ",'TEXCOORD_0':4,'TANGENT':5"},
      {{"TEXCOORD_0", GLTF, "TEXCOORD_0"}, .attribute = ",'TEXCOORD_0':4"},
      {{"TEXCOORD_1", GLTF, "TEXCOORD_1"}, .attribute = ",'TEXCOORD_0':4,'TEXCOORD_1':4"},
      {{"TEXCOORD_1 alone", GLTF, "TEXCOORD_1"}, .attribute = ",'TEXCOORD_1':4"},
      {{"TEXCOORD_1 alone adds a set", WARNING, "TEXCOORD_0 is added"}, .attribute = ",'TEXCOORD_1':4"},
      {{"the set that is added, with v up", OBJ, "vt 0 1"}, .attribute = ",'TEXCOORD_1':4"},
      {{"a primitive without TEXCOORD_0", WARNING, "1 set of texture coordinates is 0 0"},
       .attribute = ",'TEXCOORD_0':4",
       .primitive = "},{'attributes':{'POSITION':0},'indices':1"},
      {{"TEXCOORD_4", WARNING, "TEXCOORD_4 is left out"}, .attribute = ",'TEXCOORD_4':4"},
      {{"COLOR_0", GLTF, "COLOR_0"}, .attribute = ",'COLOR_0':0"},
      {{"COLOR_1", WARNING, "COLOR_1 is left out"}, .attribute = ",'COLOR_1':0"},
      {{"JOINTS_0", GLTF, "JOINTS_0"}, .attribute = ",'JOINTS_0':6,'WEIGHTS_0':6"},
      {{"an application's attribute", GLTF, "_HEAT"}, .attribute = ",'_HEAT':0"},
      {{"another attribute", WARNING, "HEAT is left out"}, .attribute = ",'HEAT':0"},
      {{"a large integer of an attribute", WARNING, "_ID is rounded where it is 16777216 or more"},
       .attribute = ",'_ID':9"},
      {{"more kinds of attributes than warnings", WARNING, "there are more warnings"},
       .attribute = TEN("A") TEN("B") TEN("C") TEN("D") TEN("E") TEN("F") TEN("G")},
      {{"targets", GLTF, "'targets':["}, .primitive = ",'targets':[{'POSITION':0}]"},
      {{"NORMAL of targets", GLTF, "'NORMAL':3}]"},
       .attribute = ",'NORMAL':0",
       .primitive = ",'targets':[{'POSITION':0,'NORMAL':0}]"},
      {{"TANGENT of targets", WARNING, "TANGENT of morph targets"},
       .primitive = ",'targets':[{'POSITION':0,'TANGENT':0}]"},
      {{"node.camera", GLTF, "'camera':0"},
       .node = ",'camera':0",
       .rest = ",'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':0.5}}]"},
      {{"node.camera that is not there", WARNING, "1 camera of a node is left out"}, .node = ",'camera':0"},
      {{"node.camera that is text", WARNING, "1 camera of a node is left out"},
       .node = ",'camera':'0'",
       .rest = ",'cameras':[{'type':'perspective','perspective':{'yfov':1,'znear':0.5}}]"},
      {{"KHR_lights_punctual", GLTF, "{'light':0}"},
       .node = ",'extensions':{'KHR_lights_punctual':{'light':0}}",
       .rest = ",'extensions':{'KHR_lights_punctual':{'lights':[{'type':'point'}]}}"},
      {{"a light that is not there", WARNING, "1 light of a node is left out"},
       .node = ",'extensions':{'KHR_lights_punctual':{'light':1}}",
       .rest = ",'extensions':{'KHR_lights_punctual':{'lights':[{'type':'point'}]}}"},
      {{"KHR_lights_punctual without a light", WARNING, "1 light of a node is left out"},
       .node = ",'extensions':{'KHR_lights_punctual':{}}"},
      {{"EXT_lights_image_based that is not there", WARNING, "1 light of a scene is left out"},
       .rest = ",'scenes':[{'nodes':[0,1,2],'extensions':{'EXT_lights_image_based':{'light':0}}}]"},
      {{"KHR_xmp_json_ld that is not there", WARNING, "1 packet of metadata is left out"},
       .node = ",'extensions':{'KHR_xmp_json_ld':{'packet':1}}",
       .rest = ",'extensions':{'KHR_xmp_json_ld':{'packets':[{}]}}"},
      {{"KHR_materials_variants without mappings", WARNING,
        "extensions/KHR_materials_variants: this is not as"},
       .primitive = ",'extensions':{'KHR_materials_variants':{'mappings':5}}"},
      {{"KHR_materials_variants", GLTF, "'mappings':[{'material':0,'variants':[0]}]"},
       .primitive = ",'extensions':{'KHR_materials_variants':{'mappings':[{'material':0,'variants':[0]}]}}",
       .rest = ",'materials':[{}],'extensions':{'KHR_materials_variants':{'variants':[{'name':'a'}]}}"},
      {{"variants that are not there", WARNING, "2 variants of primitives are left out"},
       .primitive = ",'extensions':{'KHR_materials_variants':{'mappings':["
                    "{'material':0,'variants':[0,1]},{'material':1,'variants':[0]}]}}",
       .rest = ",'materials':[{}],'extensions':{'KHR_materials_variants':{'variants':[{'name':'a'}]}}"},
      {{"variants that are there beside some that are not", GLTF,
        "'mappings':[{'material':0,'variants':[0]}]"},
       .primitive = ",'extensions':{'KHR_materials_variants':{'mappings':["
                    "{'material':0,'variants':[0,1]},{'material':1,'variants':[0]}]}}",
       .rest = ",'materials':[{}],'extensions':{'KHR_materials_variants':{'variants':[{'name':'a'}]}}"},
      {{"MSFT_lod of a node", GLTF, "'MSFT_lod':{'ids':[2,1]}"},
       .node = ",'extensions':{'MSFT_lod':{'ids':[2,1]}}"},
      {{"levels of detail that are not there", WARNING, "2 levels of detail are left out"},
       .node = ",'extensions':{'MSFT_lod':{'ids':[1,99,'2']}}"},
      {{"a level of detail beside some that are not there", GLTF, "'MSFT_lod':{'ids':[1]}"},
       .node = ",'extensions':{'MSFT_lod':{'ids':[1,99,'2']}}"},
      {{"MSFT_lod of a material", GLTF, "'MSFT_lod':{'ids':[1]}"},
       .rest = ",'materials':[{'extensions':{'MSFT_lod':{'ids':[1]}}},{}]"},
      {{"a material's level of detail that is not there", WARNING, "1 level of detail is left out"},
       .rest = ",'materials':[{'extensions':{'MSFT_lod':{'ids':[2]}}},{}]"},
      {{"the order of node.children", GLTF, "'children':[2,1]"}, .node = ",'children':[2,1]"},
      {{"node.skin", GLTF, "'skin':0"},
       .node = ",'skin':0",
       .attribute = ",'JOINTS_0':7,'WEIGHTS_0':6",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"node.matrix", GLTF, "'matrix':["}, .node = "},{'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1]"},
      {{"a matrix beside a translation", WARNING, "1 node has a matrix beside a translation"},
       .node = "},{'translation':[1,0,0],'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,7,0,0,1]"},
      {{"a matrix that shears", WARNING, "1 node has a matrix that is more than"},
       .node = "},{'matrix':[1,0,0,0,0.5,1,0,0,0,0,1,0,7,0,0,1]"},
      {{"node.rotation", GLTF, "'rotation':[0,0,1,0]"}, .node = ",'rotation':[0,0,1,0]"},
      {{"a rotation off unit length", WARNING, "1 node has a rotation that is not of unit length"},
       .node = ",'rotation':[0,0,2,0]"},
      {{"a key off unit length", WARNING, "1 rotation key is not of unit length"},
       .channel = "},{'sampler':1,'target':{'node':1,'path':'rotation'}",
       .sampler = "},{'input':2,'output':8"},
      {{"node.scale", GLTF, "'scale':[2,2,2]"}, .node = ",'scale':[2,2,2]"},
      {{"node.translation", GLTF, "'translation':[0,0,7]"}, .node = ",'translation':[0,0,7]"},
      {{"node.skin of a mesh without joints", WARNING, "1 node has a skin and shows no mesh with joints"},
       .node = ",'skin':0",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"node.skin without a mesh", WARNING, "1 node has a skin and shows no mesh with joints"},
       .node = "},{'skin':0",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"node.skin of faces beside points with joints", GLTF, "'skin':0"},
       .node = ",'skin':0",
       .primitive = "},{'mode':0,'attributes':{'POSITION':0,'JOINTS_0':7,'WEIGHTS_0':5}",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"faces without joints in it", WARNING, "JOINTS_0 is joint 0 where a primitive lacks it"},
       .node = ",'skin':0",
       .primitive = "},{'mode':0,'attributes':{'POSITION':0,'JOINTS_0':7,'WEIGHTS_0':5}",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"joints that the skin has not", WARNING, "1 point names a joint that its skin has not"},
       .node = ",'skin':0",
       .attribute = ",'JOINTS_0':6,'WEIGHTS_0':7",
       .rest = ",'skins':[{'joints':[1]}]"},
      {{"inverse bind matrices of zeros", WARNING, "1 inverse bind matrix is no affine transform"},
       .rest = ",'skins':[{'joints':[1],'inverseBindMatrices':10}]"},
      {{"node.weights", GLTF, "'weights':[0.25]"},
       .node = ",'weights':[0.25]",
       .primitive = ",'targets':[{'POSITION':0}]"},
      {{"node.weights of another number", WARNING, "morph weights of 1 node"}, .node = ",'weights':[0.25]"},
      {{"node.name", GLTF, "'name':'n'"}, .node = ",'name':'n'"},
      {{"node.name with control characters", WARNING, "1 name has control characters"},
       .node = ",'name':'a\\u0007b'"},
      {{"node.extensions", GLTF, "'ACME_a':{'b':1}"}, .node = ",'extensions':{'ACME_a':{'b':1}}"},
      {{"EXT_mesh_gpu_instancing", OBJ, "o node_0_2\n"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':3}}}"},
      {{"sampler", GLTF, "'magFilter':9729"}, .rest = ",'samplers':[{'magFilter':9729}]"},
      {{"scene", GLTF, "'scene':1"}, .rest = ",'scenes':[{'nodes':[1]},{'nodes':[0]}],'scene':1"},
      {{"a node of another scene with the same mesh", WARNING, "1 node that is not shown has a mesh"},
       .node = "},{'mesh':0",
       .rest = ",'scenes':[{'nodes':[0]},{'nodes':[1]}]"},
      {{"KHR_node_visibility", WARNING, "1 node that is not shown has a mesh"},
       .node = "},{'mesh':0,'extensions':{'KHR_node_visibility':{'visible':false}}"},
      {{"an invisible root", GLTF, "'scenes':[{'nodes':[0,1,2,3]}]"},
       .node = "},{'mesh':0,'extensions':{'KHR_node_visibility':{'visible':false}}"},
      {{"scene.name", GLTF, "'name':'s'"}, .rest = ",'scenes':[{'nodes':[0],'name':'s'}]"},
      {{"skin", GLTF, "'skeleton':1"}, .rest = ",'skins':[{'joints':[1],'skeleton':1}]"},
      {{"texture", GLTF, "'textures':[{'name':'t'}]"}, .rest = ",'textures':[{'name':'t'}]"},
      {{"a member that glTF has not", GLTF, "'more':1"}, .node = ",'more':1"},
      {{"an index that is text", WARNING, "/nodes/0/skin: left out, as this is not of the type"},
       .node = ",'skin':'0'"},
      {{"an index below 0", WARNING, "/nodes/0/skin: left out, as"}, .node = ",'skin':-1"},
      {{"an index with a fraction", WARNING, "/scene: left out, as"}, .rest = ",'scene':0.5"},
      {{"indices that are none", WARNING, "/nodes/0/children: left out, as"}, .node = ",'children':[1,'a']"},
      {{"a number in place of three", WARNING, "/nodes/0/scale: left out, as"}, .node = ",'scale':5"},
      {{"weights that are text", WARNING, "/meshes/0/weights: left out, as"}, .mesh = ",'weights':['a']"},
      {{"a word that is a number", WARNING, "/animations/0/samplers/0/interpolation: left out, as"},
       .sampler = ",'interpolation':5"},
      {{"a target whose accessor is text", WARNING, "/meshes/0/primitives/0/targets: left out, as"},
       .primitive = ",'targets':[{'POSITION':'0'}]"},
      {{"a member twice", WARNING, "1 member of an object stands twice"}, .node = ",'name':'a','name':'b'"},
      {{"a name that is a number", WARNING, "/nodes/0/name: left out, as"}, .node = ",'name':5"},
      {{"extensions of a node that are none", WARNING, "/nodes/0/extensions: left out, as"},
       .node = ",'extensions':[]"},
      {{"extensions of a material that are none", WARNING, "/materials/1/extensions: left out, as"},
       .rest = ",'materials':[{},{'extensions':5}]"},
      {{"extensionsUsed that are none", WARNING, "/extensionsUsed: left out, as"},
       .rest = ",'extensionsUsed':[5]"},
      {{"two members of another type", WARNING, "gives it, as at 1 more place"},
       .node = ",'skin':'0','scale':5"},
      {{"VRMC_vrm that is no object", WARNING, "/extensions/VRMC_vrm: this is not as"},
       .rest = ",'extensions':{'VRMC_vrm':5}"},
      {{"VRMC_vrm without bones", WARNING, "/extensions/VRMC_vrm: this is not as"},
       .rest = ",'extensions':{'VRMC_vrm':{'specVersion':'1.0'}}"},
      {{"VRMC_vrm of a version to come", WARNING, "another version than VRM 1.0"},
       .rest =
           ",'extensions':{'VRMC_vrm':{'specVersion':'2.0','humanoid':{'humanBones':{'hips':{'node':1}}}}}"},
      {{"VRM whose map is none", WARNING, "/extensions/VRM: this is not as"},
       .rest = ",'extensions':{'VRM':{'humanoid':5}}"},
      {{"EXT_mesh_gpu_instancing without attributes", WARNING,
        "/nodes/0/extensions/EXT_mesh_gpu_instancing: this is not as"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{}}"},
      {{"EXT_mesh_gpu_instancing of another type", WARNING,
        "/nodes/0/extensions/EXT_mesh_gpu_instancing: this is not as"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':5}}}"},
      {{"EXT_mesh_gpu_instancing of other counts", WARNING,
        "/nodes/0/extensions/EXT_mesh_gpu_instancing: this is not as"},
       .node = ",'extensions':{'EXT_mesh_gpu_instancing':{'attributes':{'TRANSLATION':3,'SCALE':0}}}"},
      {{"FB_ngon_encoding that is no object", WARNING,
        "/meshes/0/primitives/0/extensions/FB_ngon_encoding: this is not as"},
       .primitive = ",'extensions':{'FB_ngon_encoding':5}"},
      {{"KHR_animation_pointer without a pointer", WARNING,
        "/animations/0/channels/1/target/extensions/KHR_animation_pointer: this is not as"},
       .channel = "},{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{}}}"},
      {{"KHR_animation_pointer to no node", WARNING, "KHR_animation_pointer/pointer: this is not as"},
       .channel = "},{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{"
                  "'pointer':'/nodes/9/rotation'}}}"},
      {{"KHR_animation_pointer to no material", WARNING, "KHR_animation_pointer/pointer: this is not as"},
       .channel = "},{'sampler':0,'target':{'path':'pointer','extensions':{'KHR_animation_pointer':{"
                  "'pointer':'/materials/9/alphaCutoff'}}}"},
      {{"extras.tweend that is no object", WARNING, "/meshes/0/extras/tweend: left out"},
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
      {{"an accessor of no name", WARNING, "1 accessor is left out: nothing that is read names it"},
       "48",
       "3",
       "",
       ",{'bufferView':0,'componentType':5126,'count':1,'type':'SCALAR'}",
       ""},
      {{"a buffer view of no name", WARNING, "1 buffer view is left out: nothing that is read names it"},
       "48",
       "3",
       "",
       "",
       ",{'buffer':0,'byteLength':4}"},
      {{"a vertex of no face", WARNING, "1 vertex is in no face: answers leave it out"},
       "48",
       "4",
       "",
       "",
       ""},
      {{"bytes of no buffer view", WARNING, "10 bytes of buffers are left out"}, "36", "3", "", "", ""},
      {{"NORMAL of no length", WARNING, "1 normal or tangent is 0 0 0"},
       "48",
       "3",
       ",'NORMAL':2",
       ",{'bufferView':0,'componentType':5126,'count':3,'type':'VEC3'}",
       ""},
      {{"NORMAL off unit length", WARNING, "1 normal or tangent is not of unit length"},
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
    const row one = {"bytes of the BIN chunk", WARNING, "8 bytes behind the lengths of buffers are left out"};
    reply r = ask(*state, "model/gltf-binary", glb, size, one.where);
    assert_int_equal(r.status, 201);
    assert_int_equal(shows(&r, NULL, &one), more > 3);
    reply_free(&r);
  }
}

TEST_WITH(bytes_behind_the_length_of_a_data_uri_are_told, loopback_setup, loopback_teardown) {
  char *text =
      quoted("{'asset':{'version':'2.0'},'buffers':[{'byteLength':36,'uri':'data:application/octet-stream;"
             "base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAA'}],'bufferViews':[{'buffer':0,"
             "'byteLength':36}],'accessors':[{'bufferView':0,'componentType':5126,'count':3,'type':"
             "'VEC3'}],'meshes':[{'primitives':[{'attributes':{'POSITION':0}}]}]}");
  const row one = {"bytes of a data URI", WARNING, "3 bytes behind the lengths of buffers are left out"};
  reply r = ask(*state, "model/gltf+json", text, strlen(text), one.where);
  assert_int_equal(r.status, 201);
  assert_true(shows(&r, NULL, &one));
  reply_free(&r);
  free(text);
}

/* Forms of faces alone say where no face is in them. */
TEST_WITH(answers_without_faces_say_so, loopback_setup, loopback_teardown) {
  static const char *const forms[] = {"obj", "stl", "ply", "3mf"};
  static const struct {
    const char *text, *says;
  } models[] = {{"{'nodes':[{'name':'n'}]}", "%20is%20empty%3A%20the%20model%20has%20no%20mesh"},
                {"{'meshes':[{" MESH ",'holes':[0,1]}]}", "%20is%20empty%3A%20no%20node%20shows%20a%20face"},
                {"{'meshes':[{" MESH "}]}", NULL}};
  for (size_t m = 0; m < sizeof models / sizeof *models; m++)
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
      char target[64], wanted[100], *text = quoted(models[m].text);
      snprintf(target, sizeof target, "/v1/surface.%s?level=0", forms[i]);
      snprintf(wanted, sizeof wanted, "surface.%s%s", forms[i],
               models[m].says ? models[m].says : "%20is%20empty");
      reply r = loopback_ask(*state, "POST", target, "Content-Type: application/json\n", text, strlen(text));
      const char *warning = reply_header(&r, "X-Tweend-Warning");
      assert_int_equal(r.status, 200);
      assert_int_equal(warning && strstr(warning, wanted), models[m].says != NULL);
      reply_free(&r);
      free(text);
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
