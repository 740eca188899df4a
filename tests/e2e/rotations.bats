# Rotations in any form into any other, in one request of curl.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

near='def near($a; $b): [$a, $b] | transpose | all((.[0] - .[1]) | fabs < 2e-5);'

# convert DOCUMENT
convert() { http POST /v1/rotations --header "Content-Type: application/json" --data "$1"; }

@test "rotations of every form come back as Euler angles, with product, slerp and points" {
  convert '{"rotations": [{"quaternion": [0, 0, 0, 1]}, {"axis_angle": [0, 1, 0, 90]}, {"euler": [10, 20, 30], "order": "ZYX"},
    {"matrix": [1, 0, 0, 0, 1, 0, 0, 0, 1]}],
    "unit": "degrees", "as": "euler", "order": "XYZ", "points": [[1, 0, 0]], "slerp": [0, 0.25, 1]}'
  expect 200
  [[ $(header content-type) == application/json* ]]
  holds '[.rotations[].euler[]] | length == 12'
  holds "$near"'near(.rotations[1].euler; [0, 90, 0]) and near(.rotations[1].inverse; [0, -90, 0])'
  holds "$near"'near(.rotations[1].points[0]; [0, 0, -1])'
  holds '.rotations[1].orders.XYZ == 0 and .rotations[1].orders.YXZ == 1 and (.rotations[2].orders | keys | length) == 6'
  # Ry(90) Rz(30) Ry(20) Rx(10), its column x: Rz Ry turns x to (cos 20 cos 30, cos 20 sin 30, -sin 20).
  convert '{"rotations": [{"axis_angle": [0, 1, 0, 90]}, {"euler": [10, 20, 30], "order": "ZYX"}],
    "unit": "degrees", "as": "matrix", "slerp": [1]}'
  holds "$near"'(3.14159265358979 / 180) as $d |
    near(.product[0:3]; [-((20 * $d) | sin), ((20 * $d) | cos) * ((30 * $d) | sin), -((20 * $d) | cos) * ((30 * $d) | cos)]) and
    near(.slerp[0]; .rotations[1].matrix)'
}

@test "what is no rotation is refused with its place" {
  convert '{"rotations": [{"quaternion": [0, 0, 0, 1]}, {"quaternion": [0, 0, 0, 0]}]}'
  problem 422 zero
  holds '.errors[0].pointer == "/rotations/1/quaternion"'
  convert '{"rotations": [{"matrix": [2, 0, 0, 0, 1, 0, 0, 0, 1]}]}'
  problem 422 'no rotation'
  holds '.errors[0].pointer == "/rotations/0/matrix"'
  convert '{"rotations": [{"euler": [0, 0]}]}'
  problem 400 '3 numbers'
  convert '{"rotation": []}'
  problem 400 rotations
}
