# Clips evaluated at times: exact keys, the ways between them, hierarchy, forms of the answer.

load helper
setup_file() { start_daemon --compute-timeout 10m; } # the machine may be busy
teardown_file() { stop_daemon; }
setup() {
  cd "$BATS_TEST_TMPDIR" || return
  upload "$samples/tank.json"
  tank=/v1/models/$id
}

# Numbers as near as single precision allows.
near='def near($a; $b): [$a, $b] | transpose | all((.[0] - .[1]) | fabs < 2e-6);
      def same($a; $b): near($a; $b) or near($a; $b | map(-.));'

# agrees JQ-EXPRESSION
agrees() { holds "$near $1"; }

# ---- keys ----------------------------------------------------------------------------------------

@test "at the key times the keys come back exactly" {
  gojq -c '.clips[0].tracks[] | select(.path == "rotation" and .quaternions) | {node, times, quaternions}' \
    "$samples/tank.json" >tracks
  [ "$(wc -l <tracks)" -ge 4 ]
  while read -r track; do
    node=$(gojq -r .node <<<"$track") times=$(gojq -r '.times | join(",")' <<<"$track")
    get "$tank/pose.json?clip=drive&nodes=$node&at=$times"
    expect 200
    gojq -e --argjson track "$track" "$near"'
      [[.poses[].rotation[0]], $track.quaternions] | transpose | all(same(.[0]; .[1]))' answer
    holds "[.poses[].t] == [$times]"
  done <tracks
}

# ---- between the keys ----------------------------------------------------------------------------

@test "an Euler track passes through 0 where the same keys as quaternions pass through 180" {
  get "$tank/pose.json?clip=drive&nodes=antenna_euler,antenna_quaternion&at=0,2,4"
  agrees 'same(.poses[1].rotation[0]; [0, 0, 0, 1])'
  agrees 'same(.poses[1].rotation[1]; [0, 1, 0, 0])'
  # At the ends they agree.
  agrees 'same(.poses[0].rotation[0]; .poses[0].rotation[1]) and same(.poses[2].rotation[0]; .poses[2].rotation[1])'
}

# ---- hierarchy -----------------------------------------------------------------------------------

@test "in world space wheels, turret and barrel follow the hull" {
  nodes=hull,wheel_front_left,wheel_rear_right,turret,barrel
  get "$tank/pose.json?clip=drive&at=4&space=world&as=matrix&nodes=$nodes"
  expect 200
  cp answer world
  # The hull has turned by 75 degrees and stands at (4, 0, 6.5): a child is where the hull takes its rest.
  gojq -e "$near"'
    def hull($p): (75 * 3.14159265358979 / 180) as $a | ($a | cos) as $c | ($a | sin) as $s |
      [$c * $p[0] + $s * $p[2] + 4, $p[1], -$s * $p[0] + $c * $p[2] + 6.5];
    def place: .[12:15];
    .poses[0].matrix as $m |
    near($m[0] | place; [4, 0, 6.5]) and
    near($m[1] | place; hull([1.15, 0.45, 1.1])) and
    near($m[2] | place; hull([-1.15, 0.45, -1.1])) and
    near($m[3] | place; hull([0, 1.08, -0.2]))' world
  # The barrel sits on the turret, which has turned by 20 degrees of its own.
  gojq -e "$near"'
    (95 * 3.14159265358979 / 180) as $a | .poses[0].matrix as $m | ($m[3][12:15]) as $turret |
    near($m[4][12:15]; [$turret[0] + 0.6 * ($a | sin), $turret[1] + 0.28, $turret[2] + 0.6 * ($a | cos)])' world
}

# ---- times ---------------------------------------------------------------------------------------

@test "more times than fit a URL go into a body" {
  gojq -n '{times: [range(2000) / 500]}' >times.json
  http POST "$tank/pose?clip=drive&nodes=hull" --data-binary @times.json --header 'Content-Type: application/json'
  expect 200
  holds '(.poses | length) == 2000 and .times[1999] == 3.998'
}

# ---- forms of the answer -------------------------------------------------------------------------

@test "POST /v1/pose answers as the stored model would, and stores nothing" {
  get "$tank/pose.json?clip=drive&at=0.3,2.9&space=world&as=matrix"
  gojq . answer >stored
  http DELETE "$tank"
  post '/v1/pose.json?clip=drive&at=0.3,2.9&space=world&as=matrix' "$samples/tank.json"
  expect 200
  diff <(gojq . answer) stored
  get "$tank"
  problem 404
}

@test "one pose a line, rows of numbers, a table" {
  get "$tank/pose.ndjson?clip=drive&at=0,1,2"
  expect 200
  gojq -e -s 'map(select(has("t"))) | map(.t) == [0, 1, 2]' answer
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

# processor_seconds: those that the daemon took.
processor_seconds() { awk -v hz="$(getconf CLK_TCK)" '{ sub(/.*[)]/, ""); print ($12 + $13) / hz }' "/proc/$daemon/stat"; }

# bats test_tags=plain
@test "tracks that turn often and near lock are followed in seconds" {
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
  started=$(processor_seconds)
  get "/v1/models/$id/tracks"
  expect 200
  awk -v a="$started" -v b="$(processor_seconds)" 'BEGIN { printf "# %.2f s of processor\n", b - a; exit !(b - a < 30) }' >&3
  holds '.tracks[0] | .keys == 10000 and .gimbal.cos_middle < 0.01 and .steps_over_180 == 9999'
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

@test "a name that several nodes bear means all of them" {
  printf '%s' '{"asset":{"version":"2.0"},"nodes":[{"name":"wheel"},{"name":"body","children":[0,2]},{"name":"wheel","translation":[1,0,0]},{}]}' >wheels.gltf
  post "/v1/pose.json?at=0&nodes=wheel,node_3,wheel" wheels.gltf
  holds '.nodes == ["wheel", "wheel", "node_3"] and .poses[0].translation == [[0,0,0],[1,0,0],[0,0,0]]'
}

# ---- keys at one time ----------------------------------------------------------------------------

@test "a value jumps where two keys have one time, and falling times are refused" {
  times='[0,1,1,2]'
  document() {
    printf '%s' '{"nodes":[{"name":"a"}],"clips":[{"name":"c","tracks":[
      {"node":"a","path":"rotation","times":'"$times"',"unit":"degrees","eulers":[[0,0,0],[0,0,30],[0,0,90],[0,0,90]]},
      {"node":"a","path":"translation","interpolation":"cubicspline","times":'"$times"',"values":[[0,0,0],[1,0,0],[5,0,0],[6,0,0]],
       "in_tangents":[[0,0,0],[0,0,0],[0,0,0],[0,0,0]],"out_tangents":[[0,0,0],[0,0,0],[0,0,0],[0,0,0]]}]}]}'
  }
  document >jump.json
  upload jump.json
  holds '.warnings | map(contains("1 key at the time of the one before")) == [true, true]'
  get "/v1/models/$id/source"
  cmp answer jump.json
  get "/v1/models/$id/tracks"
  holds '.tracks[0] | .duplicate_times == 1 and .keys == 4 and .times == [0, 0.99999994, 1, 2] and (.warnings[0] | contains("jumps"))'
  get "/v1/models/$id/pose?as=euler&unit=degrees&at=0.9999,1"
  holds '[.poses[].translation[0][0] | round] == [1, 5] and [.poses[].euler[0][2] | round] == [30, 90]'
  get "/v1/models/$id/surface.glb"
  cp answer jump.glb
  glb_json jump.glb | gojq -e '. as $g | [.animations[0].samplers[] | $g.accessors[.input] | .count, .max[0]] == [4, 2, 4, 2]'
  upload jump.glb
  holds '.warnings == []'
  get "/v1/models/$id/pose?as=euler&unit=degrees&at=0.9999,1"
  holds '[.poses[].translation[0][0] | round] == [1, 5] and [.poses[].euler[0][2] | round] == [30, 90]'
  times='[0,1,1,0.5]'
  document >falling.json
  post /v1/models falling.json
  problem 422 "before the one before it"
  holds '.errors[0].pointer == "/clips/0/tracks/0/times/3"'
}
