# Clips of other models on a model's own skeleton: parameters, refusals, warnings, entity tags.

load helper
setup_file() {
  start_daemon
  cd "$BATS_FILE_TMPDIR" || return
  # Two figures of ten bones by the names of two families of rigs, and a clip on the first.
  figure() { # figure NAME... : hips spine head, then upper leg, lower leg, foot, left and right, and a clip's tracks
    gojq -n --args '
      $ARGS.positional as $n
      | [[0, 1, 0], [0, 0.2, 0], [0, 0.4, 0], [0.1, -0.1, 0], [0, -0.4, 0], [0, -0.4, 0], [-0.1, -0.1, 0], [0, -0.4, 0], [0, -0.4, 0]] as $t
      | [null, 0, 1, 0, 3, 4, 0, 6, 7] as $p
      | {nodes: [range(9) | {name: $n[.], translation: $t[.]} + (if $p[.] == null then {} else {parent: $n[$p[.]]} end)],
         clips: [{name: "step", tracks: ([range(9) | {node: $n[.], path: "rotation", unit: "degrees", times: [0, 1], axis_angles: [[1, 0, 0, 0], [1, 0, 0, 20]]}]
           + [{node: $n[0], path: "translation", times: [0, 1], values: [[0, 1, 0], [0, 1, 2]]}])}]}' "$@"
  }
  figure Hips Spine Head LeftUpLeg LeftLeg LeftFoot RightUpLeg RightLeg RightFoot >"$BATS_FILE_TMPDIR/walker.json"
  figure pelvis spine_01 head thigh_l calf_l foot_l thigh_r calf_r foot_r |
    gojq '.nodes[].translation |= map(. * 2) | del(.clips)' >"$BATS_FILE_TMPDIR/giant.json"
  upload "$BATS_FILE_TMPDIR/walker.json"
  export walker=${id##*/}
  upload "$BATS_FILE_TMPDIR/giant.json"
  export giant=/v1/models/${id##*/}
}
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

post_json() { http POST "$1" --json "$2" "${@:3}"; }

@test "a clip moves another skeleton, scaled" {
  get "$giant/pose.json?clip=$walker/step&retarget=auto&at=0,1&space=world"
  holds '.clip == "step" and .duration == 1 and (has("warnings") | not)
    and (.poses[1].translation[0] | map(. * 1000 | round)) == [0, 2000, 4000]
    and (.poses[0].rotation | map(.[3] == 1) | all)'
  get "$giant/pose.json?clip=$walker/step&at=1"
  holds '.warnings | length == 10 and (.[0] | contains("retarget=auto"))' # by names of nodes nothing moves
  [[ $(header X-Tweend-Warning) == 10* ]]
}

@test "tracks tell how bones were matched" {
  get "$giant/tracks?clip=$walker/step&retarget=auto"
  holds '.retarget | .scale == 2 and .without_target == [] and .without_source == []
    and (.bones | length == 9 and (map(.by) | unique) == ["usual"] and all(.aligned == 0))
    and .bones[3] == {"source": "LeftUpLeg", "target": "thigh_l", "by": "usual", "aligned": 0}'
  holds '.clip == "step" and (.tracks | length) == 9 and .report.root.node == "pelvis"'
  get "$giant/tracks?clip=$walker/step" # by node name, as poses have it: no node has its names
  holds '.tracks == [] and has("retarget") == false'
  get "/v1/models/$walker/tracks?clip=$walker/step" # as if it were its own
  holds '.clip == "step" and (.tracks | length) == 9 and .report.feet == ["LeftFoot", "RightFoot"] and .report.warnings == []'
}

@test "a map decides, in the query and in the body" {
  map=$(gojq -rn '{LeftUpLeg: "thigh_r", RightUpLeg: "thigh_l", Head: null} | @json | @uri')
  get "$giant/tracks?clip=$walker/step&retarget=auto&map=$map"
  holds '.retarget | .without_target == ["Head"] and .without_source == ["head"]
    and (.bones | map(select(.by == "map")) | map([.source, .target])) == [["RightUpLeg", "thigh_l"], ["LeftUpLeg", "thigh_r"]]'
  get "$giant/pose.json?clip=$walker/step&retarget=auto&at=1&map=$map"
  holds '.warnings == ["the clip moves bones that have no counterpart in the model: Head"]'
  cp answer "$BATS_TEST_TMPDIR/in_query"
  post_json "$giant/pose.json?clip=$walker/step&retarget=auto&at=1" '{"map": {"LeftUpLeg": "thigh_r", "RightUpLeg": "thigh_l", "Head": null}}'
  cmp answer "$BATS_TEST_TMPDIR/in_query"
  post_json "$giant/pose.json?clip=$walker/step&retarget=auto" '{"times": [1], "map": {"LeftUpLeg": "thigh_r", "RightUpLeg": "thigh_l", "Head": null}}'
  cmp answer "$BATS_TEST_TMPDIR/in_query"
}

@test "what is wrong with a map or a parameter is told with its name" {
  get "$giant/pose?retarget=always"
  expect 400
  get "$giant/pose?map=%7B%7D"
  expect 400
  holds '.detail | contains("retarget=auto")'
  for bad in '%7B' '%5B%5D' '7' '%7B%22a%22:7%7D'; do
    get "$giant/pose?clip=$walker/step&retarget=auto&map=$bad"
    expect 400
    holds '.detail | startswith("map: ")'
  done
  get "$giant/pose?clip=$walker/step&retarget=auto&map=%7B%22Hip%22:%22pelvis%22%7D"
  expect 422
  holds '.detail | contains("\"Hip\"") and contains("Hips")'
  get "$giant/pose?clip=$walker/step&retarget=auto&map=%7B%22Head%22:%22hat%22%7D"
  expect 422
  holds '.detail | contains("\"hat\"")'
  post_json "$giant/pose?clip=$walker/step&retarget=auto" '{"times": [0], "map": {"Head": 7}}'
  expect 400
  holds '.errors[0].pointer == "/map/Head"'
  post_json "$giant/pose?clip=$walker/step&retarget=auto" '{}'
  expect 400
}

@test "models without a skeleton, and strangers, are refused by name" {
  upload "$samples/cube.obj"
  get "/v1/models/${id##*/}/pose?clip=$walker/step&retarget=auto"
  expect 422
  holds '.detail | contains("no skeleton")'
  upload "$samples/tank.json"
  get "/v1/models/${id##*/}/pose?clip=$walker/step&retarget=auto"
  expect 422
  holds '.detail | contains("0 of") and contains("Hips")'
  get "/v1/models/${id##*/}/surface.glb?level=0&clip=$walker/step&retarget=auto"
  expect 422
  get "/v1/models/${id##*/}/live?clip=$walker/step&retarget=auto"
  expect 422
}

@test "entity tags hold the parameters; own clips stay as they are" {
  tag() { curl -sI "$url$1" | sed -n 's/^etag: //Ip' | tr -d '\r'; }
  plain=$(tag "$giant/pose.json?clip=$walker/step&at=1")
  carried=$(tag "$giant/pose.json?clip=$walker/step&at=1&retarget=auto")
  [ -n "$plain" ] && [ "$plain" != "$carried" ]
  [ "$carried" = "$(tag "$giant/pose.json?at=1&retarget=auto&clip=$walker/step")" ]
  own=/v1/models/$walker/pose.json
  [ "$(curl -s "$url$own?at=1")" = "$(curl -s "$url$own?at=1&retarget=auto")" ] # the header alone differs, which warns
  for path in pose.bvh surface.glb tracks; do
    carried=$(tag "$giant/$path?clip=$walker/step&retarget=auto")
    mapped=$(tag "$giant/$path?clip=$walker/step&retarget=auto&map=%7B%22Head%22:null%7D")
    [ -n "$carried" ] && [ "$carried" != "$mapped" ]
  done
}

@test "a model in the body is carried over to as well" {
  post "/v1/pose.json?clip=$walker/step&retarget=auto&at=1" "$BATS_FILE_TMPDIR/giant.json"
  holds '(.poses[0].translation[0] | map(. * 1000 | round)) == [0, 2000, 4000]'
}
