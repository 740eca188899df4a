# Clips evaluated at times: exact keys, the ways between them, hierarchy, forms of the answer.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() {
  cd "$BATS_TEST_TMPDIR" || return
  upload "$samples/tank.json"
  tank=/v1/models/$id
}

# Numbers as near as single precision allows.
near='def near($a; $b): [$a, $b] | transpose | all((.[0] - .[1]) | fabs < 2e-6);
      def same($a; $b): near($a; $b) or near($a; $b | map(-.));
      def turned($axis; $degrees): ($degrees * 3.14159265358979 / 360) as $half |
        [$axis[] * ($half | sin), ($half | cos)];'

# agrees JQ-EXPRESSION
agrees() { holds "$near $1"; }

# ---- keys ----------------------------------------------------------------------------------------

@test "at the key times the keys come back exactly" {
  jq -c '.clips[0].tracks[] | select(.path == "rotation" and .quaternions) | {node, times, quaternions}' \
    "$samples/tank.json" >tracks
  [ "$(wc -l <tracks)" -ge 4 ]
  while read -r track; do
    node=$(jq -r .node <<<"$track") times=$(jq -r '.times | join(",")' <<<"$track")
    get "$tank/pose.json?clip=drive&nodes=$node&at=$times"
    expect 200
    jq -e --argjson track "$track" "$near"'
      [[.poses[].rotation[0]], $track.quaternions] | transpose | all(same(.[0]; .[1]))' answer
    holds "[.poses[].t] == [$times]"
  done <tracks
}

@test "translation keys come back as they were written" {
  get "$tank/pose.json?clip=drive&nodes=hull&at=0,1.1,2.6,4"
  holds '[.poses[].translation[0]] == [[0, 0, 0], [0.1, 0, 2.5], [1.2, 0, 5.2], [4, 0, 6.5]]'
}

@test "before the first key and after the last the ends hold" {
  get "$tank/pose.json?clip=drive&nodes=turret&at=0,4,9"
  holds '.poses[1].rotation == .poses[2].rotation'
  get "$tank/pose.json?clip=drive&nodes=turret&at=-3,0"
  holds '.poses[0].rotation == .poses[1].rotation'
}

@test "nodes that no track moves keep their rest" {
  get "$tank/pose.json?clip=aim&nodes=hull,wheel_front_left&at=0.3"
  holds '.poses[0].rotation == [[0, 0, 0, 1], [0, 0, 0, 1]]'
  holds '.poses[0].translation == [[0, 0, 0], [1.15, 0.45, 1.1]]'
  holds '.poses[0].scale == [[1, 1, 1], [1, 1, 1]]'
}

# ---- between the keys ----------------------------------------------------------------------------

@test "slerp turns at constant speed between irregular keys" {
  # The turret: 0 degrees at 0 s, 35 at 0.4, -60 at 1.7 and 2.15, 20 at 4.
  get "$tank/pose.json?clip=drive&nodes=turret&at=0.1,0.725,2,3.075"
  agrees 'same(.poses[0].rotation[0]; turned([0, 1, 0]; 8.75))'
  agrees 'same(.poses[1].rotation[0]; turned([0, 1, 0]; 35 - 95 / 4))'
  agrees 'same(.poses[2].rotation[0]; turned([0, 1, 0]; -60))'
  agrees 'same(.poses[3].rotation[0]; turned([0, 1, 0]; -20))'
}

@test "an Euler track passes through 0 where the same keys as quaternions pass through 180" {
  get "$tank/pose.json?clip=drive&nodes=antenna_euler,antenna_quaternion&at=0,2,4"
  agrees 'same(.poses[1].rotation[0]; [0, 0, 0, 1])'
  agrees 'same(.poses[1].rotation[1]; [0, 1, 0, 0])'
  # At the ends they agree.
  agrees 'same(.poses[0].rotation[0]; .poses[0].rotation[1]) and same(.poses[2].rotation[0]; .poses[2].rotation[1])'
}

@test "wheels make whole turns between two keys" {
  # Right wheels: 811 degrees at 2.6 s, 1281 at 4 s.
  get "$tank/pose.json?clip=drive&nodes=wheel_front_right&at=2.6,2.95,3.3,3.65,4"
  agrees '. as $answer | [range(5)] | all(. as $i | same($answer.poses[$i].rotation[0]; turned([1, 0, 0]; 811 + 117.5 * $i)))'
}

@test "nlerp goes the same way, not at the same speed" {
  get "$tank/pose.json?clip=drive&nodes=barrel&at=0.225"
  jq -c '.poses[0].rotation[0]' answer >nlerp
  get "$tank/pose.json?clip=drive&nodes=barrel&at=0.225&interpolation=slerp"
  jq -c '.poses[0].rotation[0]' answer >slerp
  agrees 'same(.poses[0].rotation[0]; turned([-1, 0, 0]; 3))'
  jq -e -n --slurpfile n nlerp --slurpfile s slerp "$near"'
    ([$n[0], $s[0]] | transpose | all((.[0] - .[1]) | fabs < 1e-3)) and ($n[0] | map(. * .) | add - 1 | fabs < 1e-6)'
}

@test "step holds a key until the next" {
  get "$tank/pose.json?clip=aim&nodes=barrel&at=0.9,1.2,1.299,1.3"
  holds '.poses[0].rotation == .poses[1].rotation and .poses[1].rotation == .poses[2].rotation'
  holds '.poses[2].rotation != .poses[3].rotation'
}

@test "every interpolation that has a name can be asked for" {
  for name in step linear slerp nlerp squad; do
    get "$tank/pose.json?clip=drive&nodes=turret&interpolation=$name&from=0&to=4&fps=10"
    expect 200
    agrees '[.poses[].rotation[0] | map(. * .) | add] | all((. - 1) | fabs < 1e-6)'
  done
}

# ---- hierarchy -----------------------------------------------------------------------------------

@test "in world space wheels, turret and barrel follow the hull" {
  nodes=hull,wheel_front_left,wheel_rear_right,turret,barrel
  get "$tank/pose.json?clip=drive&at=4&space=world&as=matrix&nodes=$nodes"
  expect 200
  cp answer world
  # The hull has turned by 75 degrees and stands at (4, 0, 6.5): a child is where the hull takes its rest.
  jq -e "$near"'
    def hull($p): (75 * 3.14159265358979 / 180) as $a | ($a | cos) as $c | ($a | sin) as $s |
      [$c * $p[0] + $s * $p[2] + 4, $p[1], -$s * $p[0] + $c * $p[2] + 6.5];
    def place: .[12:15];
    .poses[0].matrix as $m |
    near($m[0] | place; [4, 0, 6.5]) and
    near($m[1] | place; hull([1.15, 0.45, 1.1])) and
    near($m[2] | place; hull([-1.15, 0.45, -1.1])) and
    near($m[3] | place; hull([0, 1.08, -0.2]))' world
  # The barrel sits on the turret, which has turned by 20 degrees of its own.
  jq -e "$near"'
    (95 * 3.14159265358979 / 180) as $a | .poses[0].matrix as $m | ($m[3][12:15]) as $turret |
    near($m[4][12:15]; [$turret[0] + 0.6 * ($a | sin), $turret[1] + 0.28, $turret[2] + 0.6 * ($a | cos)])' world
}

@test "a matrix in world space is the product of the local ones" {
  get "$tank/pose.json?clip=drive&at=2.2&as=matrix&nodes=hull,turret,barrel"
  cp answer local
  get "$tank/pose.json?clip=drive&at=2.2&as=matrix&space=world&nodes=barrel"
  jq -e --slurpfile local local '
    def product($a; $b): [range(16) | . as $i | [range(4) | $a[4 * . + $i % 4] * $b[4 * (($i / 4) | floor) + .]] | add];
    ($local[0].poses[0].matrix) as $m | product(product($m[0]; $m[1]); $m[2]) as $expected |
    [.poses[0].matrix[0], $expected] | transpose | all((.[0] - .[1]) | fabs < 1e-5)' answer
}

# ---- times ---------------------------------------------------------------------------------------

@test "from, to and fps give evenly spaced times" {
  get "$tank/pose.json?clip=drive&nodes=hull&from=1&to=2&fps=4"
  holds '.times == [1, 1.25, 1.5, 1.75, 2]'
  holds '[.poses[].t] == .times'
}

@test "loop=repeat and loop=pingpong fold times beyond the end" {
  get "$tank/pose.json?clip=drive&nodes=turret&at=0.5,4.5&loop=repeat"
  agrees 'same(.poses[0].rotation[0]; .poses[1].rotation[0])'
  get "$tank/pose.json?clip=drive&nodes=turret&at=3.5,4.5&loop=pingpong"
  agrees 'same(.poses[0].rotation[0]; .poses[1].rotation[0])'
  get "$tank/pose.json?clip=drive&nodes=turret&at=4,4.5&loop=clamp"
  holds '.poses[0].rotation == .poses[1].rotation'
}

@test "the first clip is the default, a clip is found by its name" {
  get "$tank/pose.json?at=0"
  holds '.clip == "drive" and .duration == 4'
  get "$tank/pose.json?at=0&clip=aim"
  holds '.clip == "aim"'
}

@test "more times than fit a URL go into a body" {
  jq -n '{times: [range(2000) / 500]}' >times.json
  http POST "$tank/pose?clip=drive&nodes=hull" --data-binary @times.json --header 'Content-Type: application/json'
  expect 200
  holds '(.poses | length) == 2000 and .times[1999] == 3.998'
}

# ---- forms of the answer -------------------------------------------------------------------------

@test "all nodes in the file's order, one entry each" {
  get "$tank/pose.json?clip=drive&at=1"
  names='["hull","wheel_front_left","wheel_front_right","wheel_rear_left","wheel_rear_right","turret","barrel","antenna_euler","antenna_quaternion"]'
  holds ".nodes == $names"
  holds '.space == "local" and .as == "trs"'
  holds '.poses | length == 1'
  holds '.poses[0] | (.rotation | length) == 9 and (.translation | length) == 9 and (.scale | length) == 9'
}

@test "a rotation as Euler angles, in each order, in degrees" {
  for order in XYZ XZY YXZ YZX ZXY ZYX; do
    get "$tank/pose.json?clip=drive&nodes=turret,barrel&at=0.4,0.9&as=euler&order=$order&unit=degrees"
    expect 200
    # One axis alone turns: the angle stands at its place whatever the order.
    holds '.poses[0].euler[0] | (.[1] - 35 | fabs) < 1e-4 and (.[0] | fabs) < 1e-4 and (.[2] | fabs) < 1e-4'
    holds '.poses[1].euler[1] | (.[0] + 12 | fabs) < 1e-4 and (.[1] | fabs) < 1e-4 and (.[2] | fabs) < 1e-4'
  done
  get "$tank/pose.json?clip=drive&nodes=turret&at=0.4&as=euler"
  holds '.poses[0].euler[0][1] - 35 * 3.14159265358979 / 180 | fabs < 1e-6'
}

@test "a rotation as axis and angle" {
  get "$tank/pose.json?clip=drive&nodes=turret&at=0.4&as=axis-angle&unit=degrees"
  holds '.poses[0].axis_angle[0] | (.[1] - 1 | fabs) < 1e-5 and (.[3] - 35 | fabs) < 1e-3'
}

@test "POST /v1/pose answers as the stored model would, and stores nothing" {
  get "$tank/pose.json?clip=drive&at=0.3,2.9&space=world&as=matrix"
  jq -S . answer >stored
  http DELETE "$tank"
  post '/v1/pose.json?clip=drive&at=0.3,2.9&space=world&as=matrix' "$samples/tank.json"
  expect 200
  diff <(jq -S . answer) stored
  get "$tank"
  problem 404
}

@test "one pose a line, rows of numbers, a table" {
  get "$tank/pose.ndjson?clip=drive&at=0,1,2"
  expect 200
  jq -e -s 'map(select(has("t"))) | map(.t) == [0, 1, 2]' answer
  get "$tank/pose.csv?clip=drive&at=0,1,2&nodes=hull"
  expect 200
  [[ $(header content-type) == text/csv* ]]
  [ "$(wc -l <answer)" -ge 4 ]
  get "$tank/pose.bin?clip=drive&at=0,1,2&nodes=hull"
  expect 200
  [ "$(header content-length)" = "$(stat -c %s answer)" ]
}

@test "tracks tell the Euler track's long way from the quaternions' short one" {
  get "$tank/tracks?clip=drive"
  expect 200
  holds '.clip == "drive" and (.tracks | length) >= 8'
  holds '.tracks | all(has("node") and has("path") and has("kind") and has("keys"))'
}

@test "at 90 degrees of the middle angle each order loses its last axis" {
  for order in XYZ XZY YXZ YZX ZXY ZYX; do
    # The middle angle goes from 60 to 160 degrees in a second: through 90 at 0.3 s.
    jq -n --arg order $order '
      def triple($middle): [["X", "Y", "Z"][] | if . == $order[1:2] then $middle else 0 end];
      {nodes: [{name: "n"}], clips: [{tracks: [{node: "n", path: "rotation", interpolation: "euler", order: $order,
       unit: "degrees", times: [0, 1], eulers: [triple(60), triple(160)]}]}]}' >lock.json
    upload lock.json
    get "/v1/models/$id/tracks"
    jq -e --arg order $order '.tracks[0] | .gimbal.order == $order and (.gimbal.time - 0.3 | fabs) < 1e-6
      and .gimbal.cos_middle < 1e-6 and (.gimbal.amplification == null or .gimbal.amplification > 1e6)
      and .gimbal.lost_axis == ($order[2:3] | ascii_downcase)
      and .orders[$order] == .gimbal.cos_middle and .best_order != $order and .orders[.best_order] > 0.1' answer
    # There the first and the last angle turn about one line: what is left is their sum or difference.
    get "/v1/models/$id/pose?at=0.3&as=euler&order=$order&unit=degrees"
    jq -e --arg order $order '(["X", "Y", "Z"] | index($order[1:2])) as $middle |
      .poses[0].euler[0] | (.[$middle] - 90 | fabs) < 0.1 and (del(.[$middle]) | all(fabs < 0.1))' answer
  done
}

@test "170 degrees about +x and about -x are 20 degrees apart" {
  jq -n '{nodes: [{name: "n"}], clips: [{tracks: [{node: "n", path: "rotation", interpolation: "slerp", unit: "degrees",
    times: [0, 1], eulers: [[170, 0, 0], [-170, 0, 0]]}]}]}' >opposite.json
  upload opposite.json
  get "/v1/models/$id/tracks"
  holds '.tracks[0] | (.total_degrees - 20 | fabs) < 1e-4 and (.peak_degrees_per_second - 20 | fabs) < 1e-4'
  get "/v1/models/$id/pose?at=0,0.25,0.5,0.75,1&as=euler&unit=degrees"
  holds '[.poses[].euler[0][0]] as $x | [range(5)] | all(. as $i | $x[$i] - (170 + 5 * $i) | fabs < 1e-3)'
}

@test "Euler angles go on over the top, by the twin of the plain ones" {
  # A turn about the middle axis alone: beyond 90 degrees the plain triple would jump to [180, 90 - …, 180].
  jq -n '{nodes: [{name: "n"}], clips: [{tracks: [{node: "n", path: "rotation", unit: "degrees", times: [0, 1],
    axis_angles: [[0, 1, 0, 0], [0, 1, 0, 720]]}]}]}' >loop.json
  upload loop.json
  get "/v1/models/$id/pose?from=0&to=1&fps=48&as=euler&order=XYZ&unit=degrees"
  holds '[.poses[].euler[0]] as $e | [range(49)] |
    all(. as $i | ($e[$i][1] - 15 * $i | fabs) < 1e-2 and ($e[$i][0] | fabs) < 1e-2 and ($e[$i][2] | fabs) < 1e-2)'
  get "/v1/models/$id/pose?at=0.25&as=euler&order=XYZ&unit=degrees" # 180 degrees, without what came before
  holds '.poses[0].euler[0] | (.[1] | fabs) < 1e-2 and (.[0] | fabs) > 179.9 and (.[2] | fabs) > 179.9'
}

@test "tracks that turn often and near lock are followed in seconds" {
  needs_plain_build
  awk 'BEGIN {
    n = 10000
    printf "{\"nodes\":[{\"name\":\"n\"}],\"clips\":[{\"tracks\":[{\"node\":\"n\",\"path\":\"rotation\",\"interpolation\":\"euler\",\"order\":\"YXZ\","
    printf "\"times\":[0"
    for (i = 1; i < n; i++) printf ",%d", i
    printf "],\"eulers\":[[1.2,0,0]"
    for (i = 1; i < n; i++) printf ",[%.6f,%d,%d]", 1.2 + 0.37 * i / n, 50 * i, -50 * i
    printf "]}]}]}"
  }' >whirl.json
  upload whirl.json
  started=$EPOCHREALTIME
  get "/v1/models/$id/tracks"
  expect 200
  awk -v a="$started" -v b="$EPOCHREALTIME" 'BEGIN { printf "# %.2f s\n", b - a; exit !(b - a < 10) }' >&3
  holds '.tracks[0] | .keys == 10000 and .gimbal.cos_middle < 0.01 and .steps_over_180 == 9999'
}

@test "pose answers can be cached for ever" {
  get "$tank/pose.json?clip=drive&at=1"
  [[ $(header cache-control) == *immutable* ]]
  etag=$(header etag)
  get "$tank/pose.json?clip=drive&at=1" --header "If-None-Match: $etag"
  expect 304
}

# ---- refusals ------------------------------------------------------------------------------------

@test "a clip or a node that is not there is named in the refusal" {
  get "$tank/pose.json?clip=dance&at=0"
  [[ $status == 4* ]]
  problem "$status" dance
  get "$tank/pose.json?at=0&nodes=hull,sail"
  [[ $status == 4* ]]
  problem "$status" sail
}

@test "times that are none" {
  for query in at=nan at=inf at=1,,2 at=x 'from=0&to=1' 'from=1&to=0&fps=10' 'from=0&to=1&fps=0' 'from=0&to=1&fps=-5' 'at=1&from=0&to=1&fps=2'; do
    get "$tank/pose.json?$query"
    problem 400
  done
}

@test "unknown parameters and values are refused by name" {
  get "$tank/pose.json?at=0&speed=2"
  problem 400 speed
  for query in space=screen as=quaternion as=euler\&order=XYX unit=turns loop=bounce interpolation=cosine; do
    get "$tank/pose.json?at=0&$query"
    problem 400
  done
}

@test "a model without clips has no pose to give but its rest" {
  upload "$samples/cube.obj"
  get "/v1/models/$id/pose.json?at=0&clip=drive"
  [[ $status == 4* ]]
  problem "$status"
}

@test "more times than the limit are refused with the number" {
  get "$tank/pose.json?from=0&to=1000000&fps=1000"
  problem 422 '1000000'
}
