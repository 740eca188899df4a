/* Quaternion algebra, matrices, TRS. */
#include <string.h>

#include "quat.h"
#include "rotation_reference.h"
#include "test.h"

static void assert_near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance)) fail_msg("%.9g is not %.9g within %g", a, b, tolerance);
}

TEST(a_zero_axis_gives_no_rotation) {
  float q[4];
  tw_quat_from_axis_angle((double[3]){0, 0, 0}, 1.0, q);
  assert_true(q[0] == 0 && q[1] == 0 && q[2] == 0 && q[3] == 1);
}

TEST(quarter_turn_about_z_takes_x_to_y) {
  float q[4], v[3];
  tw_quat_from_axis_angle((double[3]){0, 0, 7}, REF_PI / 2, q);
  tw_quat_rotate(q, (float[3]){1, 0, 0}, v);
  assert_near((double)v[0], 0, 1e-7);
  assert_near((double)v[1], 1, 1e-7);
  assert_near((double)v[2], 0, 1e-7);
}

TEST(product_applies_the_right_factor_first) {
  float a[4], b[4], ab[4], v[3];
  tw_quat_from_axis_angle((double[3]){0, 0, 1}, REF_PI / 2, a);
  tw_quat_from_axis_angle((double[3]){1, 0, 0}, REF_PI / 2, b);
  tw_quat_multiply(a, b, ab);
  tw_quat_rotate(ab, (float[3]){0, 1, 0}, v); /* b: y to z; a: z stays */
  assert_near((double)v[2], 1, 1e-6);
}

TEST(inverse_undoes) {
  uint64_t seed = 1;
  for (int i = 0; i < 100; i++) {
    float q[4], inverse[4], one[4];
    ref_narrow(ref_random_unit(&seed), q);
    tw_quat_inverse(q, inverse);
    tw_quat_multiply(q, inverse, one);
    assert_near((double)one[3], 1, 1e-6);
    assert_near((double)(fabsf(one[0]) + fabsf(one[1]) + fabsf(one[2])), 0, 1e-6);
  }
}

TEST(axis_angle_of_a_rotation_is_at_most_half_a_turn) {
  float q[4], axis_angle[4];
  tw_quat_from_axis_angle((double[3]){0, 1, 0}, 270 * REF_DEGREES, q);
  tw_quat_to_axis_angle(q, axis_angle);
  assert_near((double)axis_angle[1], -1, 1e-6);
  assert_near((double)axis_angle[3], REF_PI / 2, 1e-6);
  tw_quat_to_axis_angle((float[4]){0, 0, 0, -1}, axis_angle);
  assert_true(axis_angle[0] == 1 && axis_angle[3] == 0);
}

TEST(matrices_agree_with_rotating_the_unit_vectors) {
  uint64_t seed = 2;
  for (int n = 0; n < 1000; n++) {
    float q[4], m[9], back[4];
    ref_narrow(ref_random_unit(&seed), q);
    ref_matrix expected = ref_matrix_of(ref_of(q));
    tw_quat_to_matrix3(q, m);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 3; j++) assert_near((double)m[3 * j + i], expected.at[i][j], 5e-7);
    tw_quat_from_matrix3(m, back);
    assert_true(ref_angle(ref_of(q), ref_of(back)) < 1e-6);
  }
}

TEST(half_turns_survive_the_matrix) {
  for (int axis = 0; axis < 3; axis++) {
    float q[4] = {0, 0, 0, 0}, m[9], back[4];
    q[axis] = 1;
    tw_quat_to_matrix3(q, m);
    tw_quat_from_matrix3(m, back);
    assert_true(fabsf(back[axis]) == 1);
  }
}

TEST(slerp_takes_the_short_way_at_constant_speed) {
  uint64_t seed = 3;
  for (int n = 0; n < 1000; n++) {
    float a[4], b[4], at[4], before[4];
    ref_narrow(ref_random_unit(&seed), a);
    ref_narrow(ref_random_unit(&seed), b);
    double whole = ref_angle(ref_of(a), ref_of(b)), travelled = 0;
    memcpy(before, a, sizeof before);
    for (int i = 1; i <= 16; i++) {
      tw_quat_slerp(a, b, (float)i / 16, at);
      double step = ref_angle(ref_of(before), ref_of(at));
      assert_near(step, whole / 16, 1e-6);
      travelled += step;
      memcpy(before, at, sizeof before);
    }
    assert_true(travelled <= REF_PI + 1e-5);
    assert_true(ref_angle(ref_of(at), ref_of(b)) < 1e-6);
  }
}

TEST(an_arc_to_the_opposite_sign_goes_half_way_round) {
  const double a[4] = {0.1, -0.5, 0.7, 0.5}, b[4] = {-0.1, 0.5, -0.7, -0.5};
  tw_arc arc = tw_arc_between(a, b);
  double middle[4], end[4];
  tw_arc_at(&arc, 0.5, middle);
  tw_arc_at(&arc, 1, end);
  assert_near(quat_dot(middle, a), 0, 1e-12);
  assert_near(quat_dot(middle, middle), 1, 1e-12);
  for (int i = 0; i < 4; i++) assert_near(end[i], b[i], 1e-12);
}

TEST(trs_survives_the_matrix) {
  uint64_t seed = 4;
  for (int n = 0; n < 1000; n++) {
    tw_trs trs = {.translation = {1, 2, (float)n}}, back;
    ref_narrow(ref_random_unit(&seed), trs.rotation);
    for (int i = 0; i < 3; i++) trs.scale[i] = (float)exp(ref_between(&seed, -3, 3));
    if (n % 2) trs.scale[0] = -trs.scale[0];
    float m[16];
    tw_trs_to_matrix(&trs, m);
    assert_true(tw_trs_from_matrix(m, &back));
    assert_true(ref_angle(ref_of(trs.rotation), ref_of(back.rotation)) < 1e-6);
    for (int i = 0; i < 3; i++) {
      assert_near((double)(back.scale[i] / trs.scale[i]), 1, 1e-6);
      assert_true(back.translation[i] == trs.translation[i]);
    }
  }
}

TEST(shear_is_told_and_its_fit_is_finite) {
  tw_trs trs;
  float sheared[16] = {1, 0, 0, 0, 0.5f, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  assert_false(tw_trs_from_matrix(sheared, &trs));
  /* The nearest rotation stands between the axes: as far from x as from the leaning y. */
  float x[3], y[3];
  tw_quat_rotate(trs.rotation, (float[3]){1, 0, 0}, x);
  tw_quat_rotate(trs.rotation, (float[3]){0, 1, 0}, y);
  double lean = hypot(0.5, 1);
  assert_near((double)x[0], ((double)y[0] * 0.5 + (double)y[1]) / lean, 1e-6);
}

TEST(zero_axes_and_odd_last_rows_are_told) {
  tw_trs trs;
  for (int zeros = 1; zeros <= 3; zeros++) {
    float m[16] = {0, 0, 3, 0, 0, 2, 0, 0, -1, 0, 0, 0, 5, 6, 7, 1};
    for (int i = 0; i < zeros; i++) memset(m + 4 * i, 0, 3 * sizeof *m);
    assert_false(tw_trs_from_matrix(m, &trs));
    ref_quat q = ref_of(trs.rotation);
    assert_near(ref_dot(q, q), 1, 1e-6);
    assert_near((double)trs.scale[0], 0, 1e-6);
    if (zeros == 1) assert_near((double)trs.scale[1], 2, 1e-6);
    float back[16];
    tw_trs_to_matrix(&trs, back);
    for (int i = 0; i < 16; i++) assert_near((double)back[i], (double)m[i], 1e-5);
  }
  float projective[16] = {1, 0, 0, 0.5f, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  assert_false(tw_trs_from_matrix(projective, &trs));
}

/* Along one axis alone, where a last bit would choose among many rotations, and so would the processor. */
TEST(one_axis_gives_the_same_rotation_on_every_processor) {
  tw_trs trs;
  const float m[16] = {175.05899f, 947.8759f, 126.97069f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  static const float expected[4] = {0.0445181802f, -0.0480861403f, 0.638481259f, 0.766842544f};
  assert_false(tw_trs_from_matrix(m, &trs));
  for (int i = 0; i < 4; i++) assert_true(trs.rotation[i] == expected[i]);
  assert_true(trs.scale[0] == 972.232483f && trs.scale[1] == 0 && trs.scale[2] == 0);
}

TEST(matrix_product_is_the_books) {
  float a[16], b[16], ab[16];
  for (int i = 0; i < 16; i++) {
    a[i] = (float)(i * i % 7);
    b[i] = (float)(i * 5 % 11);
  }
  tw_matrix_multiply(a, b, ab);
  for (int i = 0; i < 4; i++)
    for (int j = 0; j < 4; j++) {
      float sum = 0;
      for (int k = 0; k < 4; k++) sum += a[4 * k + i] * b[4 * j + k];
      assert_true(ab[4 * j + i] == sum);
    }
  tw_matrix_multiply(a, b, a);
  assert_memory_equal(a, ab, sizeof a);
}
