/* Quaternion algebra, matrices, TRS. */
#include <string.h>

#include "quat.h"
#include "rotation_reference.h"
#include "test.h"

static void assert_near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance)) fail_msg("%.9g is not %.9g within %g", a, b, tolerance);
}

TEST(axis_angle_of_a_rotation_is_at_most_half_a_turn) {
  float q[4], axis_angle[4];
  ref_narrow(ref_axis_angle(0, 1, 0, 270 * REF_DEGREES), q);
  tw_quat_to_axis_angle(q, axis_angle);
  assert_near((double)axis_angle[1], -1, 1e-6);
  assert_near((double)axis_angle[3], REF_PI / 2, 1e-6);
  tw_quat_to_axis_angle((float[4]){0, 0, 0, -1}, axis_angle);
  assert_true(axis_angle[0] == 1 && axis_angle[3] == 0);
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
  ref_matrix axes = ref_matrix_of(ref_of(trs.rotation));
  double lean = hypot(0.5, 1);
  assert_near(axes.at[0][0], (axes.at[0][1] * 0.5 + axes.at[1][1]) / lean, 1e-6);
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
