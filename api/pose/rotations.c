/* Converts rotations between all forms, without a model: a list in the body, converted, multiplied, slerped
 * from the first to the last, and applied to points. Computed in double precision, printed in single. */
#include "handlers.h"
#include "json_in.h"
#include "json_value.h"
#include "pose_body.h"
#include "service.h"
#include "upload.h"

#include <float.h>
#include <math.h>

/* The contract's limits; points count once for each rotation that turns them. */
enum { ROTATIONS_MOST = 100000, TURNED_POINTS_MOST = 100000 };

enum { WIDTH_MOST = 9, MATRIX4_WIDTH = 16 };

/* Far more than any extrapolation needs; the cosine of the angle is still precise to 1e-7. */
static const double SLERP_MOST = 1e9;

/* By tw_rotation_form: the member that holds a rotation, in the request and the answer. */
static const char *const form_members[] = {"quaternion", "axis_angle", "euler", "matrix"};

typedef struct rotations_request {
  uint64_t max_times; /* the limit on slerp_count */
  tw_rotation_form as;
  tw_euler_order order; /* of TW_AS_EULER, else ignored */
  bool in_degrees, has_points, has_slerp;
  uint32_t count, point_count, slerp_count;
  double (*rotations)[4]; /* [count], unit quaternions */
  double (*points)[3];    /* [point_count] */
  double *slerp;          /* [slerp_count] */
} rotations_request;

/* ---- the request ----------------------------------------------------------------------------- */

/* [count] elements, at least one. NULL without memory, which sets *status. */
static void *allocate(const api_json *json, uint32_t count, size_t size, tw_status *status) {
  void *memory = *status == TW_OK ? tw_arena_alloc(json->arena, count ? count : 1, size) : NULL;
  if (*status == TW_OK && !memory) *status = api_json_no_memory(json);
  return memory;
}

/* Finds the one member that holds the rotation. */
static tw_status find_form(const api_value *object, const api_value *values, tw_rotation_form *out) {
  int found = -1;
  for (int i = 0; i < TW_ROTATION_FORMS; i++) {
    if (!values[i].item) continue;
    if (found >= 0)
      return api_json_fail(&values[i], TW_SYNTAX, "the rotation is given as %s already", form_members[found]);
    found = i;
  }
  if (found < 0)
    return api_json_fail(object, TW_SYNTAX, "the rotation has no quaternion, axis_angle, euler or matrix");
  *out = (tw_rotation_form)found;
  return TW_OK;
}

/* Takes the rotation out of a 4 x 4 matrix that does nothing else: m becomes 3 x 3. */
static tw_status drop_fourth(const api_value *value, double *m) {
  for (int i = 0; i < 4; i++) {
    if (m[12 + i] != (i == 3) || m[4 * i + 3] != (i == 3))
      return api_json_fail(value, TW_INVALID,
                           "the matrix is no rotation: its last column and its last row are not 0 0 0 1");
  }
  for (int i = 0; i < WIDTH_MOST; i++) m[i] = m[4 * (i / 3) + i % 3];
  return TW_OK;
}

static tw_status read_numbers(const api_value *value, tw_rotation_form form, double *out) {
  uint32_t width = tw_rotation_widths[form], count;
  tw_status status = api_json_count(value, UINT32_MAX, &count);
  if (status != TW_OK) return status;
  bool is_matrix4 = form == TW_AS_MATRIX && count == MATRIX4_WIDTH;
  if (count != width && !is_matrix4)
    return api_json_fail(value, TW_SYNTAX, "%u%s numbers are expected, not %u", width,
                         form == TW_AS_MATRIX ? " or 16" : "", count);
  status = api_json_double_list(value, out);
  return status == TW_OK && is_matrix4 ? drop_fourth(value, out) : status;
}

/* Converts angles between radians and the request's unit. */
static void scale_angles(tw_rotation_form form, double factor, double *values) {
  if (form == TW_AS_EULER)
    for (int i = 0; i < 3; i++) values[i] *= factor;
  if (form == TW_AS_AXIS_ANGLE) values[3] *= factor;
}

static tw_status read_rotation(void *context, const api_value *object) {
  static const char *const names[] = {"quaternion", "axis_angle", "euler", "matrix", "order", NULL};
  enum { ORDER = TW_ROTATION_FORMS, MEMBERS };
  const rotations_request *request = context;
  api_value values[MEMBERS];
  double numbers[MATRIX4_WIDTH];
  tw_rotation_form form = TW_AS_QUATERNION;
  int order = TW_XYZ;
  tw_status status = api_json_members(object, names, values);
  if (status == TW_OK) status = find_form(object, values, &form);
  if (status == TW_OK && values[ORDER].item && form != TW_AS_EULER)
    return api_json_fail(&values[ORDER], TW_SYNTAX, "order is for euler");
  if (status == TW_OK) status = api_json_choice(&values[ORDER], tw_euler_order_names, &order);
  if (status == TW_OK) status = read_numbers(&values[form], form, numbers);
  if (status != TW_OK) return status;
  if (request->in_degrees) scale_angles(form, 1 / TW_DEGREES, numbers);
  tw_error why;
  status = tw_rotation_read(form, (tw_euler_order)order, numbers, request->rotations[object->at.index], &why);
  return status == TW_OK ? TW_OK : api_json_fail(&values[form], status, "%s", why.detail);
}

static tw_status read_rotations(const api_value *root, const api_value *array, rotations_request *out) {
  if (!array->item) return api_json_fail(root, TW_SYNTAX, "\"rotations\" is missing");
  tw_status status = api_json_count(array, ROTATIONS_MOST, &out->count);
  if (status == TW_OK && out->count == 0) return api_json_fail(array, TW_SYNTAX, "a rotation is expected");
  out->rotations = allocate(root->json, out->count, sizeof *out->rotations, &status);
  return status == TW_OK ? api_json_each(array, read_rotation, out) : status;
}

static tw_status read_points(const api_value *array, rotations_request *out) {
  out->has_points = array->item;
  tw_status status = api_json_count(array, TURNED_POINTS_MOST, &out->point_count);
  if (status == TW_OK && (uint64_t)out->point_count * out->count > TURNED_POINTS_MOST)
    return api_json_fail(array, TW_LIMIT, "%u %s turned by %u %s %s over the limit of %d", out->point_count,
                         tw_plural(out->point_count, "point", "points"), out->count,
                         tw_plural(out->count, "rotation", "rotations"),
                         tw_plural(out->point_count, "is", "are"), TURNED_POINTS_MOST);
  out->points = allocate(array->json, out->point_count, sizeof *out->points, &status);
  if (status == TW_OK) status = api_json_double_rows(array, 3, &out->points[0][0]);
  for (uint32_t i = 0; status == TW_OK && i < out->point_count; i++) {
    const double *p = out->points[i];
    const api_value point = {array->json, NULL, {&array->at, NULL, i}};
    /* A rotated coordinate may be as large as the point's distance. */
    if (!(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] < (double)FLT_MAX * (double)FLT_MAX))
      status = api_json_fail(&point, TW_INVALID, "the point is too far away for a float");
  }
  return status;
}

static tw_status read_slerp(const api_value *array, rotations_request *out) {
  out->has_slerp = array->item;
  uint32_t most = out->max_times < UINT32_MAX ? (uint32_t)out->max_times : UINT32_MAX;
  tw_status status = api_json_count(array, most, &out->slerp_count);
  out->slerp = allocate(array->json, out->slerp_count, sizeof *out->slerp, &status);
  if (status == TW_OK) status = api_json_double_list(array, out->slerp);
  for (uint32_t i = 0; status == TW_OK && i < out->slerp_count; i++) {
    const api_value t = {array->json, NULL, {&array->at, NULL, i}};
    if (fabs(out->slerp[i]) > SLERP_MOST)
      status = api_json_fail(&t, TW_INVALID, "t is beyond %g", SLERP_MOST);
  }
  return status;
}

static tw_status read_document(void *context, const api_value *root) {
  rotations_request *out = context;
  static const char *const names[] = {"rotations", "unit", "as", "order", "points", "slerp", NULL};
  enum { ROTATIONS, UNIT, AS, ORDER, POINTS, SLERP, MEMBERS };
  /* By tw_rotation_form. */
  static const char *const forms[] = {"quaternion", "axis-angle", "euler", "matrix", NULL};
  static const char *const units[] = {"radians", "degrees", NULL};
  api_value values[MEMBERS];
  int as = TW_AS_QUATERNION, order = TW_XYZ, unit = 0;
  tw_status status = api_json_members(root, names, values);
  if (status == TW_OK) status = api_json_choice(&values[UNIT], units, &unit);
  if (status == TW_OK) status = api_json_choice(&values[AS], forms, &as);
  if (status == TW_OK) status = api_json_choice(&values[ORDER], tw_euler_order_names, &order);
  out->as = (tw_rotation_form)as;
  out->order = (tw_euler_order)order;
  out->in_degrees = unit == 1;
  if (status == TW_OK) status = read_rotations(root, &values[ROTATIONS], out);
  if (status == TW_OK) status = read_points(&values[POINTS], out);
  return status == TW_OK ? read_slerp(&values[SLERP], out) : status;
}

/* ---- the answer ------------------------------------------------------------------------------ */

static uint64_t count_numbers(const rotations_request *request) {
  uint64_t width = tw_rotation_widths[request->as];
  uint64_t each = 2 * width + 3 * (uint64_t)request->point_count + TW_EULER_ORDERS;
  return request->count * each + width * (1 + (uint64_t)request->slerp_count);
}

static api_outcome check_size(api_call *call, const rotations_request *request) {
  uint64_t limit = call->service->limits.max_output, numbers = count_numbers(request);
  if (numbers > limit / API_POSE_NUMBER_BYTES)
    return api_fail_with(call, 422, "the answer has %llu numbers, more than %llu bytes hold",
                         (unsigned long long)numbers, (unsigned long long)limit);
  return API_DONE;
}

/* To floats, whose shortest text is round where the number is. */
static void narrow(const double *values, uint32_t count, float *out) {
  for (uint32_t i = 0; i < count; i++) out[i] = (float)values[i];
}

/* Prints a rotation in the form asked for. */
static void print_rotation(const rotations_request *request, const double q[4], tw_text *text) {
  double values[WIDTH_MOST];
  float told[WIDTH_MOST];
  uint32_t width = tw_rotation_widths[request->as];
  tw_rotation_write(q, request->as, request->order, values);
  if (request->in_degrees) scale_angles(request->as, TW_DEGREES, values);
  narrow(values, width, told);
  tw_text_vectors(text, told, width, width, 1);
}

static void print_points(const rotations_request *request, const double q[4], tw_text *text) {
  tw_member_open(text, "points", "[");
  for (uint32_t i = 0; i < request->point_count; i++) {
    double turned[3];
    float told[3];
    tw_rotation_turn(q, request->points[i], turned);
    narrow(turned, 3, told);
    tw_text_element(text);
    tw_text_vectors(text, told, 3, 3, 1);
  }
  tw_text_add(text, "]");
}

static void print_entry(const rotations_request *request, const double q[4], tw_text *text) {
  const double inverse[4] = {-q[0], -q[1], -q[2], q[3]};
  tw_text_element(text);
  tw_text_add(text, "{");
  tw_text_member(text, form_members[request->as]);
  print_rotation(request, q, text);
  tw_text_member(text, "inverse");
  print_rotation(request, inverse, text);
  if (request->has_points) print_points(request, q, text);
  tw_member_open(text, "orders", "{");
  for (int order = 0; order < TW_EULER_ORDERS; order++)
    tw_member_float(text, tw_euler_order_names[order],
                    (float)tw_rotation_cos_middle(q, (tw_euler_order)order));
  tw_text_add(text, "}}");
}

static void print_product(const rotations_request *request, tw_text *text) {
  double product[4] = {0, 0, 0, 1};
  for (uint32_t i = 0; i < request->count; i++) tw_rotation_multiply(product, request->rotations[i], product);
  tw_text_member(text, "product");
  print_rotation(request, product, text);
}

static void print_slerp(const rotations_request *request, tw_text *text) {
  tw_member_open(text, "slerp", "[");
  for (uint32_t i = 0; i < request->slerp_count; i++) {
    double between[4];
    tw_rotation_slerp(request->rotations[0], request->rotations[request->count - 1], request->slerp[i],
                      between);
    tw_text_element(text);
    print_rotation(request, between, text);
  }
  tw_text_add(text, "]");
}

api_outcome api_post_rotations(api_call *call) {
  if (call->effort != API_HEAVY) return API_NEEDS_THREAD;
  rotations_request request = {.max_times = call->service->limits.max_times};
  api_outcome outcome = api_upload_json(call, API_JSON_VALUES_MAX, read_document, &request);
  if (outcome == API_DONE) outcome = check_size(call, &request);
  if (outcome != API_DONE) return outcome;
  tw_text text = {0};
  tw_text_add(&text, "{");
  tw_member_open(&text, "rotations", "[");
  for (uint32_t i = 0; i < request.count; i++) print_entry(&request, request.rotations[i], &text);
  tw_text_add(&text, "]");
  print_product(&request, &text);
  if (request.has_slerp) print_slerp(&request, &text);
  tw_text_add(&text, "}\n");
  return api_reply(call, &text);
}
