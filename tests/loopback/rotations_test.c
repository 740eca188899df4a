/* POST /v1/rotations: every form into every other, against matrices that are computed here from the
 * textbook's formulas; refusals with their places; limits. */
#include "loopback.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double DEGREE = 3.14159265358979323846 / 180;
static const char *const orders[] = {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"};

static reply post(loopback *loop, const char *body) {
  return loopback_post(loop, "/v1/rotations", "application/json", body);
}

static cJSON *convert(loopback *loop, const char *body) {
  reply r = post(loop, body);
  if (r.status != 200) fail_msg("%s: %s", body, r.body);
  cJSON *tree = cJSON_Parse(r.body);
  assert_non_null(tree);
  reply_free(&r);
  return tree;
}

static const cJSON *entry(const cJSON *answer, int index) {
  return cJSON_GetArrayItem(json_member(answer, "rotations"), index);
}

static void numbers(const cJSON *array, int count, double *out) {
  assert_int_equal(cJSON_GetArraySize(array), count);
  for (int i = 0; i < count; i++) out[i] = cJSON_GetArrayItem(array, i)->valuedouble;
}

static void assert_near(const cJSON *array, int count, const double *expected) {
  double values[16];
  numbers(array, count, values);
  for (int i = 0; i < count; i++)
    if (fabs(values[i] - expected[i]) > 2e-6) fail_msg("[%d] is %g, expected %g", i, values[i], expected[i]);
}

/* ---- the formulas: matrices m[row][column] --------------------------------------------------- */

typedef struct matrix {
  double m[3][3];
} matrix;

static matrix multiply(matrix a, matrix b) {
  matrix c = {0};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) c.m[i][j] += a.m[i][k] * b.m[k][j];
  return c;
}

static matrix transpose(matrix a) {
  matrix c;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) c.m[i][j] = a.m[j][i];
  return c;
}

/* Rodrigues' formula. */
static matrix about(double x, double y, double z, double angle) {
  double length = sqrt(x * x + y * y + z * z), c = cos(angle), s = sin(angle), t = 1 - c;
  x /= length, y /= length, z /= length;
  return (matrix){{{t * x * x + c, t * x * y - s * z, t * x * z + s * y},
                   {t * x * y + s * z, t * y * y + c, t * y * z - s * x},
                   {t * x * z - s * y, t * y * z + s * x, t * z * z + c}}};
}

static matrix of_euler(const double degrees[3], const char *order) {
  matrix product = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int i = 0; i < 3; i++) {
    int axis = order[i] - 'X';
    product = multiply(product, about(axis == 0, axis == 1, axis == 2, degrees[axis] * DEGREE));
  }
  return product;
}

static matrix of_quaternion(const double q[4]) {
  double x = q[0], y = q[1], z = q[2], w = q[3];
  return (matrix){{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                   {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                   {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

static matrix of_columns(const double v[9]) {
  return (matrix){{{v[0], v[3], v[6]}, {v[1], v[4], v[7]}, {v[2], v[5], v[8]}}};
}

static void assert_same(matrix a, matrix b, const char *what) {
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      if (fabs(a.m[i][j] - b.m[i][j]) > 2e-6)
        fail_msg("%s: row %d, column %d is %g, expected %g", what, i, j, a.m[i][j], b.m[i][j]);
}

/* ---- forms ----------------------------------------------------------------------------------- */

static const char *const forms[] = {"quaternion", "axis-angle", "euler", "matrix"};
static const char *const members[] = {"quaternion", "axis_angle", "euler", "matrix"};

/* The rotation that a value of a form says, in degrees. */
static matrix read_form(int form, const char *order, const cJSON *value) {
  static const int widths[] = {4, 4, 3, 9};
  double v[9];
  numbers(value, widths[form], v);
  if (form == 0) assert_true(fabs(v[0] * v[0] + v[1] * v[1] + v[2] * v[2] + v[3] * v[3] - 1) < 1e-6);
  switch (form) {
  case 0: return of_quaternion(v);
  case 1: return about(v[0], v[1], v[2], v[3] * DEGREE);
  case 2: return of_euler(v, order);
  default: return of_columns(v);
  }
}

/* Four rotations that stand for nothing special, one in each form. */
static const char mixed[] = "[{'quaternion':[0.2,-0.4,0.8,-1]},{'axis_angle':[1,2,-2,430]},"
                            "{'euler':[10,20,30],'order':'YZX'},{'matrix':[0,0.6,0.8,1,0,0,0,0.8,-0.6]}]";
enum { MIXED = 4 };

static void fill_mixed(matrix out[MIXED]) {
  const double length = sqrt(0.04 + 0.16 + 0.64 + 1);
  const double q[4] = {0.2 / length, -0.4 / length, 0.8 / length, -1 / length};
  const double angles[3] = {10, 20, 30}, columns[9] = {0, 0.6, 0.8, 1, 0, 0, 0, 0.8, -0.6};
  out[0] = of_quaternion(q);
  out[1] = about(1, 2, -2, 430 * DEGREE);
  out[2] = of_euler(angles, "YZX");
  out[3] = of_columns(columns);
}

/* |cos| of the middle angle, of which a product of three turns shows the sine in one entry. */
static double distance_from_lock(matrix m, const char *order) {
  double sine = m.m[order[0] - 'X'][order[2] - 'X'];
  return sqrt(1 - sine * sine);
}

static void check_forms(loopback *loop, int form, const char *order) {
  char body[600], in_order[32] = "";
  matrix expected[MIXED], product = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  if (form == 2) snprintf(in_order, sizeof in_order, ",'order':'%s'", order);
  snprintf(body, sizeof body, "{'rotations':%s,'unit':'degrees','as':'%s'%s,'points':[[1,0,0],[3,-4,5]]}",
           mixed, forms[form], in_order);
  cJSON *answer = convert(loop, body);
  fill_mixed(expected);
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "rotations")), MIXED);
  for (int i = 0; i < MIXED; i++) {
    const cJSON *told = entry(answer, i), *points = json_member(told, "points");
    double(*m)[3] = expected[i].m;
    const double first[3] = {m[0][0], m[1][0], m[2][0]};
    double second[3];
    for (int j = 0; j < 3; j++) second[j] = 3 * m[j][0] - 4 * m[j][1] + 5 * m[j][2];
    assert_same(read_form(form, order, json_member(told, members[form])), expected[i], forms[form]);
    assert_same(read_form(form, order, json_member(told, "inverse")), transpose(expected[i]), "inverse");
    assert_int_equal(cJSON_GetArraySize(points), 2);
    assert_near(cJSON_GetArrayItem(points, 0), 3, first);
    assert_near(cJSON_GetArrayItem(points, 1), 3, second);
    for (int j = 0; j < 6; j++) {
      double distance = json_member(json_member(told, "orders"), orders[j])->valuedouble;
      if (fabs(distance - distance_from_lock(expected[i], orders[j])) > 1e-6)
        fail_msg("rotation %d, %s: %g from lock", i, orders[j], distance);
    }
    product = multiply(product, expected[i]);
  }
  assert_same(read_form(form, order, json_member(answer, "product")), product, "product");
  assert_null(cJSON_GetObjectItem(answer, "slerp"));
  cJSON_Delete(answer);
}

TEST_WITH(every_form_turns_into_every_other, loopback_setup, loopback_teardown) {
  for (int form = 0; form < 4; form++)
    for (int order = 0; order < (form == 2 ? 6 : 1); order++) check_forms(*state, form, orders[order]);
}

TEST_WITH(each_order_is_read_as_its_product, loopback_setup, loopback_teardown) {
  const double angles[3] = {-35, 110, 70};
  for (int i = 0; i < 6; i++) {
    char body[200];
    snprintf(body, sizeof body,
             "{'rotations':[{'euler':[-35,110,70],'order':'%s'}],'unit':'degrees','as':'matrix'}", orders[i]);
    cJSON *answer = convert(*state, body);
    assert_same(read_form(3, NULL, json_member(entry(answer, 0), "matrix")), of_euler(angles, orders[i]),
                orders[i]);
    cJSON_Delete(answer);
  }
}

/* The bytes are what a person expects to read. */
TEST_WITH(round_numbers_stay_round, loopback_setup, loopback_teardown) {
  reply r = post(*state, "{'rotations':[{'euler':[10,20,30]}],'unit':'degrees','as':'euler'}");
  assert_says(&r, "{'rotations':[{'euler':[10,20,30],'inverse':[");
  assert_says(&r, "'product':[10,20,30]}\n");
  assert_string_equal(reply_header(&r, "Content-Type"), "application/json");
  reply_free(&r);
  r = post(*state, "{'rotations':[{'quaternion':[0,0,0,5]}]}");
  assert_body(&r, "{'rotations':[{'quaternion':[0,0,0,1],'inverse':[0,0,0,1],"
                  "'orders':{'XYZ':1,'XZY':1,'YXZ':1,'YZX':1,'ZXY':1,'ZYX':1}}],"
                  "'product':[0,0,0,1]}\n");
  reply_free(&r);
}

TEST_WITH(angles_are_radians_unless_said_otherwise, loopback_setup, loopback_teardown) {
  const double half[4] = {0, 0, 1, 3.14159265358979323846 / 2};
  cJSON *answer =
      convert(*state, "{'rotations':[{'axis_angle':[0,0,9,1.5707963267948966]}],'as':'axis-angle'}");
  assert_near(json_member(entry(answer, 0), "axis_angle"), 4, half);
  cJSON_Delete(answer);
}

TEST_WITH(an_order_is_ignored_where_nothing_is_printed_in_it, loopback_setup, loopback_teardown) {
  static const char *const forms[] = {"quaternion", "axis-angle", "matrix"};
  for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
    char with[160], without[128];
    snprintf(without, sizeof without, "{'rotations':[{'euler':[1,2,3],'order':'ZYX'}],'as':'%s'}", forms[i]);
    snprintf(with, sizeof with, "{'order':'YZX',%s", without + 1);
    reply r = loopback_post(*state, "/v1/rotations", "application/json", without),
          same = loopback_post(*state, "/v1/rotations", "application/json", with);
    assert_int_equal(same.status, 200);
    assert_string_equal(same.body, r.body);
    reply_free(&r);
    reply_free(&same);
  }
}

/* A quarter turn about y locks the orders with y in the middle, and is half way from two others. */
TEST_WITH(lock_is_told_by_order, loopback_setup, loopback_teardown) {
  cJSON *answer = convert(*state, "{'rotations':[{'euler':[0,90,25]}],'unit':'degrees','as':'euler'}");
  const cJSON *told = json_member(entry(answer, 0), "orders");
  const double turned[3] = {25, 90, 0}; /* all of it on the first axis */
  assert_true(json_member(told, "XYZ")->valuedouble == 0);
  assert_true(json_member(told, "YXZ")->valuedouble > 0.5);
  assert_near(json_member(entry(answer, 0), "euler"), 3, turned);
  cJSON_Delete(answer);
}

/* ---- product and slerp ----------------------------------------------------------------------- */

TEST_WITH(the_first_matrix_is_leftmost, loopback_setup, loopback_teardown) {
  /* Rx(90) Rz(90): z is turned first. (1, 0, 0) goes to y by Rz, from there to z by Rx. */
  const double columns[9] = {0, 0, 1, -1, 0, 0, 0, -1, 0};
  cJSON *answer = convert(*state, "{'rotations':[{'axis_angle':[1,0,0,90]},{'axis_angle':[0,0,1,90]}],"
                                  "'unit':'degrees','as':'matrix'}");
  assert_near(json_member(answer, "product"), 9, columns);
  cJSON_Delete(answer);
}

TEST_WITH(slerp_goes_the_short_way_evenly, loopback_setup, loopback_teardown) {
  /* From 10 to 350 degrees the short way is 20 degrees through 0; -q says the same as q. */
  const char *const ends[] = {
      "{'axis_angle':[0,0,1,10]},{'axis_angle':[1,0,0,77]},{'axis_angle':[0,0,1,350]}",
      "{'axis_angle':[0,0,1,10]},{'axis_angle':[0,0,1,-10]}"};
  const double expected[] = {10, 5, 0, -10, -20, 20};
  for (size_t i = 0; i < 2; i++) {
    char body[300];
    snprintf(body, sizeof body,
             "{'rotations':[%s],'unit':'degrees','as':'euler','slerp':[0,0.25,0.5,1,1.5,-0.5]}", ends[i]);
    cJSON *answer = convert(*state, body);
    const cJSON *slerp = json_member(answer, "slerp");
    assert_int_equal(cJSON_GetArraySize(slerp), 6);
    for (int j = 0; j < 6; j++) assert_near(cJSON_GetArrayItem(slerp, j), 3, (double[3]){0, 0, expected[j]});
    cJSON_Delete(answer);
  }
}

TEST_WITH(slerp_of_one_rotation_stays, loopback_setup, loopback_teardown) {
  cJSON *answer = convert(*state, "{'rotations':[{'quaternion':[0,1,0,0]}],'slerp':[0.3],'points':[]}");
  const double still[4] = {0, 1, 0, 0};
  assert_near(cJSON_GetArrayItem(json_member(answer, "slerp"), 0), 4, still);
  assert_int_equal(cJSON_GetArraySize(json_member(entry(answer, 0), "points")), 0);
  cJSON_Delete(answer);
}

/* ---- matrices -------------------------------------------------------------------------------- */

TEST_WITH(matrices_of_four_columns_and_of_three_decimals_are_read, loopback_setup, loopback_teardown) {
  cJSON *answer = convert(*state, "{'rotations':[{'matrix':[0,1,0,0,-1,0,0,0,0,0,1,0,0,0,0,1]},"
                                  "{'matrix':[0.707,0.707,0,-0.707,0.707,0,0,0,1]}],"
                                  "'unit':'degrees','as':'euler'}");
  assert_near(json_member(entry(answer, 0), "euler"), 3, (double[3]){0, 0, 90});
  assert_near(json_member(entry(answer, 1), "euler"), 3, (double[3]){0, 0, 45});
  cJSON_Delete(answer);
}

/* Columns may be off unit length by 0.001, as the document says: their squares by twice as much. */
TEST_WITH(columns_within_a_thousandth_of_unit_length_are_read, loopback_setup, loopback_teardown) {
  const double lengths[] = {0.9985, 0.9989, 0.999, 0.9993, 1, 1.0007, 1.001, 1.0011, 1.0015};
  for (size_t i = 0; i < sizeof lengths / sizeof *lengths; i++) {
    bool is_near = fabs(lengths[i] - 1) < 0.00101;
    char body[300];
    snprintf(body, sizeof body,
             "{'rotations':[{'matrix':[0,%g,0,%g,0,0,0,0,%g]}],'unit':'degrees','as':'euler'}", lengths[i],
             -lengths[i], lengths[i]);
    if (!is_near) {
      assert_problem(post(*state, body), 422, "/rotations/0/matrix", "column 0 has length");
      continue;
    }
    cJSON *answer = convert(*state, body);
    assert_near(json_member(entry(answer, 0), "euler"), 3, (double[3]){0, 0, 90});
    cJSON_Delete(answer);
  }
}

TEST_WITH(quaternions_of_matrices_have_no_negative_w, loopback_setup, loopback_teardown) {
  for (int i = 0; i < 60; i++) {
    double angle = (6 * i - 177) * DEGREE, half = angle / 2, sine = sin(half) / 3;
    matrix m = about(i % 3 ? 1 : -1, 2, i % 2 ? 2 : -2, angle);
    const double expected[4] = {i % 3 ? sine : -sine, 2 * sine, i % 2 ? 2 * sine : -2 * sine, cos(half)};
    char body[400], *end = body + sprintf(body, "{'rotations':[{'matrix':[");
    for (int j = 0; j < 9; j++) end += sprintf(end, "%s%.9f", j ? "," : "", m.m[j % 3][j / 3]);
    sprintf(end, "]}]}");
    cJSON *answer = convert(*state, body);
    assert_near(json_member(entry(answer, 0), "quaternion"), 4, expected);
    cJSON_Delete(answer);
  }
}

/* ---- refusals -------------------------------------------------------------------------------- */

TEST_WITH(what_is_no_rotation_is_422_with_its_place, loopback_setup, loopback_teardown) {
  const char *const bad[][3] = {
      {"{'quaternion':[0,0,0,0]}", "/rotations/1/quaternion", "zero"},
      {"{'axis_angle':[0,0,0,1]}", "/rotations/1/axis_angle", "axis"},
      {"{'axis_angle':[0,0,1,2e9]}", "/rotations/1/axis_angle", "beyond"},
      {"{'euler':[0,-2e9,0]}", "/rotations/1/euler", "beyond"},
      {"{'matrix':[2,0,0,0,1,0,0,0,1]}", "/rotations/1/matrix", "column 0 has length 2"},
      {"{'matrix':[1e200,0,0,0,1,0,0,0,1]}", "/rotations/1/matrix", "column 0"},
      {"{'matrix':[1,0,0,0.6,0.8,0,0,0,1]}", "/rotations/1/matrix", "columns 0 and 1"},
      {"{'matrix':[-1,0,0,0,1,0,0,0,1]}", "/rotations/1/matrix", "mirrors"},
      {"{'matrix':[0,0,0,0,0,0,0,0,0]}", "/rotations/1/matrix", "length 0"},
      {"{'matrix':[1,0,0,0,0,1,0,0,0,0,1,0,5,0,0,1]}", "/rotations/1/matrix", "last column"},
      {"{'matrix':[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}", "/rotations/1/matrix", "last row"}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
    char body[300];
    snprintf(body, sizeof body, "{'rotations':[{'quaternion':[0,0,0,1]},%s]}", bad[i][0]);
    assert_problem(post(*state, body), 422, bad[i][1], bad[i][2]);
  }
}

TEST_WITH(malformed_documents_are_400_with_their_place, loopback_setup, loopback_teardown) {
  const char *const bad[][3] = {
      {"{", NULL, NULL},
      {"[]", "", "object"},
      {"{}", "", "missing"},
      {"{'rotations':{}}", "/rotations", "array"},
      {"{'rotations':[]}", "/rotations", "a rotation"},
      {"{'rotations':[7]}", "/rotations/0", "object"},
      {"{'rotations':[{}]}", "/rotations/0", "quaternion"},
      {"{'rotations':[{'quaternion':null}]}", "/rotations/0/quaternion", "array"},
      {"{'rotations':[{'quaternion':[0,0,1]}]}", "/rotations/0/quaternion", "4 numbers"},
      {"{'rotations':[{'quaternion':[0,0,1,'x']}]}", "/rotations/0/quaternion/3", "number"},
      {"{'rotations':[{'matrix':[1,0,0,0]}]}", "/rotations/0/matrix", "9 or 16"},
      {"{'rotations':[{'quaternion':[0,0,0,1],'euler':[0,0,0]}]}", "/rotations/0/euler", "already"},
      {"{'rotations':[{'quaternion':[0,0,0,1],'order':'XYZ'}]}", "/rotations/0/order", "euler"},
      {"{'rotations':[{'euler':[0,0,0],'order':'XYX'}]}", "/rotations/0/order", "ZYX"},
      {"{'rotations':[{'euler':[0,0,0]}],'order':'XYX'}", "/order", "ZYX"},
      {"{'rotations':[{'euler':[0,0,0]}],'as':'axis_angle'}", "/as", "axis-angle"},
      {"{'rotations':[{'euler':[0,0,0]}],'unit':'turns'}", "/unit", "degrees"},
      {"{'rotations':[{'euler':[0,0,0]}],'points':[[1,2]]}", "/points/0", "3 numbers"},
      {"{'rotations':[{'euler':[0,0,0]}],'slerp':['half']}", "/slerp/0", "number"},
      {"{'rotations':[{'euler':[0,0,0]}],'t':[0]}", "", "slerp"}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
    assert_problem(post(*state, bad[i][0]), 400, bad[i][1], bad[i][2]);
  assert_problem(loopback_get(*state, "/v1/rotations"), 405, NULL, "POST");
  assert_problem(loopback_post(*state, "/v1/rotations", "text/plain", "{}"), 415, NULL, NULL);
  assert_problem(loopback_post(*state, "/v1/rotations?as=euler", "application/json", "{}"), 400, NULL, NULL);
}

TEST_WITH(numbers_that_no_float_holds_are_422, loopback_setup, loopback_teardown) {
  assert_problem(post(*state, "{'rotations':[{'euler':[0,0,0]}],'points':[[1,2,3],[3e38,3e38,0]]}"), 422,
                 "/points/1", "far");
  assert_problem(post(*state, "{'rotations':[{'euler':[0,0,0]}],'slerp':[0,1e300]}"), 422, "/slerp/1",
                 "beyond");
}

/* Prints `head`, `count` times `element` with commas, and `tail`; freed by the caller. */
static char *repeat(const char *head, const char *element, size_t count, const char *tail) {
  size_t length = strlen(element) + 1;
  char *body = malloc(strlen(head) + count * length + strlen(tail) + 1), *end = body;
  assert_non_null(body);
  end += sprintf(end, "%s", head);
  for (size_t i = 0; i < count; i++) end += sprintf(end, "%s%s", i ? "," : "", element);
  sprintf(end, "%s", tail);
  return body;
}

static loopback *start_large(void) {
  api_settings settings = loopback_settings();
  settings.limits.max_upload = 16 << 20;
  settings.limits.max_times = 10;
  return loopback_start(&settings);
}

TEST(a_hundred_thousand_rotations_are_answered_and_no_more) {
  static const char head[] = "{'rotations':[", element[] = "{'axis_angle':[0,0,1,0.5]}";
  loopback *loop = start_large();
  char *body = repeat(head, element, 100000, "],'points':[[1,0,0]]}");
  cJSON *answer = convert(loop, body);
  /* 50,000 radians in all: the product has lost nothing to its 100,000 steps. */
  const double expected[4] = {0, 0, sin(25000), cos(25000)};
  assert_int_equal(cJSON_GetArraySize(json_member(answer, "rotations")), 100000);
  assert_near(json_member(answer, "product"), 4, expected);
  cJSON_Delete(answer);
  free(body);
  body = repeat(head, element, 100000, "],'points':[[1,0,0],[0,1,0]]}");
  assert_problem(post(loop, body), 422, "/points", "100000");
  free(body);
  body = repeat(head, element, 100001, "]}");
  assert_problem(post(loop, body), 422, "/rotations", "100001");
  free(body);
  loopback_stop(loop);
}

TEST(slerp_has_the_limit_of_times) {
  loopback *loop = start_large();
  char *body = repeat("{'rotations':[{'euler':[0,0,0]}],'slerp':[", "0.5", 10, "]}");
  cJSON_Delete(convert(loop, body));
  free(body);
  body = repeat("{'rotations':[{'euler':[0,0,0]}],'slerp':[", "0.5", 11, "]}");
  assert_problem(post(loop, body), 422, "/slerp", "at most 10");
  free(body);
  loopback_stop(loop);
}

TEST(an_answer_over_the_limit_of_output_is_refused) {
  api_settings settings = loopback_settings();
  settings.limits.max_output = 250;
  loopback *loop = loopback_start(&settings);
  cJSON_Delete(convert(loop, "{'rotations':[{'euler':[0,0,0]}]}"));
  assert_problem(post(loop, "{'rotations':[{'euler':[0,0,0]}],'as':'matrix'}"), 422, NULL, "250");
  loopback_stop(loop);
}
