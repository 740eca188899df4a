/* Euler angles in the six orders. */
#include <string.h>

#include "quat.h"
#include "rotation_reference.h"
#include "test.h"

/* The axis of an order's nth letter. */
static int axis_of(tw_euler_order order, int n) {
  return tw_euler_order_names[order][n] - 'X';
}

static double error_against(const float q[4], ref_matrix expected) {
  return ref_matrix_angle(ref_matrix_of(ref_of(q)), expected);
}

TEST(order_names_are_the_matrix_products) {
  uint64_t seed = 1;
  for (int n = 0; n < 6000; n++) {
    tw_euler_order order = (tw_euler_order)(n % TW_EULER_ORDERS);
    double angles[3], exact[4];
    float q[4];
    for (int i = 0; i < 3; i++) angles[i] = ref_between(&seed, -10, 10);
    tw_quat_euler(angles, order, exact);
    quat_narrow(exact, q);
    assert_true(error_against(q, ref_euler(angles, order)) < 5e-7);
  }
}

TEST(angles_of_a_quaternion_give_it_back) {
  uint64_t seed = 2;
  for (int n = 0; n < 6000; n++) {
    tw_euler_order order = (tw_euler_order)(n % TW_EULER_ORDERS);
    float q[4], angles[3];
    ref_narrow(ref_random_unit(&seed), q);
    tw_quat_to_euler(q, order, angles);
    double wide[3] = {(double)angles[0], (double)angles[1], (double)angles[2]};
    assert_true(error_against(q, ref_euler(wide, order)) < 1e-6);
    for (int i = 0; i < 3; i++) assert_true(fabs(wide[i]) <= REF_PI + 1e-7);
    assert_true(fabs(wide[axis_of(order, 1)]) <= REF_PI / 2 + 1e-7);
  }
}

TEST(gimbal_lock_puts_the_turn_into_the_first_axis) {
  for (tw_euler_order order = TW_XYZ; order <= TW_ZYX; order++)
    for (int side = -1; side <= 1; side += 2) {
      double angles[3];
      float q[4], back[3];
      angles[axis_of(order, 0)] = 0.3;
      angles[axis_of(order, 1)] = side * REF_PI / 2;
      angles[axis_of(order, 2)] = 0.4;
      ref_narrow(ref_euler_quat(angles, order), q);
      tw_quat_to_euler(q, order, back);
      assert_true(back[axis_of(order, 2)] == 0);
      assert_true(fabs((double)back[axis_of(order, 1)] - side * REF_PI / 2) < 1e-6);
      /* Only the sum or the difference of the outer angles is left. */
      double first = (double)back[axis_of(order, 0)];
      assert_true(fabs(first - 0.7) < 1e-6 || fabs(first + 0.1) < 1e-6);
      double wide[3] = {(double)back[0], (double)back[1], (double)back[2]};
      assert_true(error_against(q, ref_euler(wide, order)) < 1e-6);
    }
}

TEST(at_90_degrees_the_first_and_last_axis_turn_the_same_way) {
  for (tw_euler_order order = TW_XYZ; order <= TW_ZYX; order++)
    for (int side = -1; side <= 1; side += 2) {
      bool even = (axis_of(order, 0) + 1) % 3 == axis_of(order, 1);
      double angles[3], turned[3];
      float q[4], r[4];
      for (int i = 0; i < 3; i++) angles[axis_of(order, i)] = (double[3]){0.3, side * REF_PI / 2, -1.1}[i];
      memcpy(turned, angles, sizeof turned);
      /* What the first axis turns, the last one turns back. */
      turned[axis_of(order, 0)] += 0.7;
      turned[axis_of(order, 2)] += (even == (side > 0)) ? -0.7 : 0.7;
      ref_narrow(ref_euler_quat(angles, order), q);
      ref_narrow(ref_euler_quat(turned, order), r);
      assert_true(ref_angle(ref_of(q), ref_of(r)) < 1e-6);
      /* A degree before lock it is no longer so. */
      angles[axis_of(order, 1)] *= 89.0 / 90;
      turned[axis_of(order, 1)] *= 89.0 / 90;
      ref_narrow(ref_euler_quat(angles, order), q);
      ref_narrow(ref_euler_quat(turned, order), r);
      assert_true(ref_angle(ref_of(q), ref_of(r)) > 0.01);
    }
}

TEST(precision_holds_up_to_gimbal_lock) {
  for (tw_euler_order order = TW_XYZ; order <= TW_ZYX; order++)
    for (int digits = 1; digits < 12; digits++) {
      double angles[3];
      float q[4], back[3];
      angles[axis_of(order, 0)] = 0.3;
      angles[axis_of(order, 1)] = REF_PI / 2 - pow(10, -digits);
      angles[axis_of(order, 2)] = -1.4;
      ref_narrow(ref_euler_quat(angles, order), q);
      tw_quat_to_euler(q, order, back);
      double wide[3] = {(double)back[0], (double)back[1], (double)back[2]};
      assert_true(error_against(q, ref_euler(wide, order)) < 1e-6);
    }
}

TEST(nearest_angles_follow_a_path_through_turns_and_lock) {
  for (tw_euler_order order = TW_XYZ; order <= TW_ZYX; order++) {
    float previous[3] = {0, 0, 0};
    for (int n = 0; n <= 4000; n++) {
      double angles[3];
      float q[4], near[3];
      angles[axis_of(order, 0)] = 0.002 * n; /* over a whole turn */
      angles[axis_of(order, 1)] = 0.003 * n; /* through lock, over the top and round */
      angles[axis_of(order, 2)] = -0.004 * n;
      ref_narrow(ref_euler_quat(angles, order), q);
      tw_quat_to_euler_near(q, order, previous, near);
      for (int i = 0; i < 3; i++) {
        /* Beside lock the outer angles are known to single precision over the cosine only. */
        double room = 1e-5 + 1e-6 / fmax(1e-3, fabs(cos(angles[axis_of(order, 1)])));
        if (fabs((double)near[i] - angles[i]) > room)
          fail_msg("order %u step %d axis %d: %g, not %g", order, n, i, (double)near[i], angles[i]);
      }
      memcpy(previous, near, sizeof previous);
    }
  }
}

TEST(nearest_angles_at_lock_keep_the_inner_angle) {
  for (tw_euler_order order = TW_XYZ; order <= TW_ZYX; order++)
    for (int side = -1; side <= 1; side += 2) {
      double angles[3];
      float q[4], previous[3], near[3];
      for (int i = 0; i < 3; i++) {
        angles[axis_of(order, i)] = (double[3]){2.5, side * REF_PI / 2, 9.75}[i];
        previous[axis_of(order, i)] = (float)angles[axis_of(order, i)];
      }
      ref_narrow(ref_euler_quat(angles, order), q);
      tw_quat_to_euler_near(q, order, previous, near);
      for (int i = 0; i < 3; i++) assert_true(fabs((double)near[i] - angles[i]) < 2e-6);
    }
}
