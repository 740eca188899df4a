# Models that edits make of stored ones.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# edit ID JSON
edit() { http POST "/v1/models/$1/edits" --header 'Content-Type: application/json' --data "$2"; }

upload_box() {
  echo '{"meshes": [{"name": "hull", "shape": {"kind": "box", "size": [2, 1, 4], "segments": [2, 1, 3]}}]}' >box.json
  upload box.json
}

@test "edits make a model with an address of its own" {
  upload_box
  box=$id
  edit "$box" '{"mesh": "hull", "edits": [
    {"edit": "extrude", "faces": {"facing": [0, 1, 0], "within": 10}, "distance": 0.4, "name": "deck"},
    {"edit": "inset", "faces": {"made": "deck"}, "amount": 0.2},
    {"edit": "loop_cut", "edge": [0, 1], "cuts": 2, "at": [0.1, 0.9]},
    {"edit": "crease", "edges": {"sharper_than": 60}, "sharpness": 2}]}'
  expect 201
  id=$(value .id)
  [ "$id" != "$box" ]
  [ "$(header location)" = "/v1/models/$id" ]
  holds '.format == "glb" and .name == "hull" and .warnings == []'
  holds '.meshes[0] | .vertices == 68 and .faces == 66 and .euler_characteristic == 2 and .creases > 0'
  holds '.made.deck | (.faces | length) == 12 and (.vertices | length) == 12'
  get "/v1/models/$box"
  holds '.meshes[0] | .vertices == 24 and .faces == 22'
  get "/v1/models/$id/surface.glb?level=2"
  expect 200
}

@test "the same edits again are the same model" {
  upload_box
  edit "$id" '{"edits": [{"edit": "inset", "faces": [3], "amount": 0.1}]}'
  expect 201
  first=$(value .id)
  edit "$id" '{"edits": [{"edit": "inset", "faces": [3], "amount": 0.1}]}'
  expect 200
  [ "$(value .id)" = "$first" ]
}

@test "what is stored is the cage, for the validator and for any other daemon" {
  upload "$samples/cube.obj"
  edit "$id" '{"edits": [{"edit": "inset", "faces": [0], "amount": 0.1, "name": "in"},
    {"edit": "hole", "faces": {"made": "in"}}, {"edit": "corner", "vertices": {"made": "in"}, "sharpness": 3},
    {"edit": "subdivide", "edges": [[0, 1]]}, {"edit": "crease", "edges": "all"}]}'
  expect 201
  id=$(value .id)
  get "/v1/models/$id/source"
  mv answer stored.glb
  get "/v1/models/$id/surface.glb?level=0&polygons=ngon&normals=none"
  expect 200
  cmp answer stored.glb
  post /v1/models stored.glb
  expect 200
  [ "$(value .id)" = "$id" ]
}

@test "an edit that cannot be done is 422 with the pointer, and nothing is stored" {
  upload_box
  get '/v1/models?limit=1000'
  before=$(value '.models | length')
  edit "$id" '{"edits": [{"edit": "flip"}, {"edit": "loop_cut", "edge": [0, 23]}]}'
  expect 422
  holds '.errors[0].pointer == "/edits/1/edge"'
  edit "$id" '{"edits": [{"edit": "subdivide", "faces": "all", "cuts": 9999}]}'
  expect 422
  holds '.detail | contains("2200000000 faces")'
  get '/v1/models?limit=1000'
  [ "$(value '.models | length')" = "$before" ]
}

@test "a mirror welds what lies on its plane, or not" {
  echo '{"meshes": [{"shape": {"kind": "grid"}, "edits": [{"edit": "move", "faces": "all", "by": [0.5, 0, 0]}]}]}' >half.json
  upload half.json
  for weld in true 1e-6; do
    edit "$id" '{"edits": [{"edit": "mirror", "axis": "x", "weld": '$weld'}]}'
    holds '.meshes[0].vertices == 6'
  done
  for weld in false -1; do
    edit "$id" '{"edits": [{"edit": "mirror", "axis": "x", "weld": '$weld'}]}'
    holds '.meshes[0].vertices == 8'
  done
  edit "$id" '{"edits": [{"edit": "mirror", "axis": "x", "weld": "all"}]}'
  expect 400
}

@test "a refined mesh gives its cage back" {
  upload "$samples/octopus.obj"
  cage=$id
  get "/v1/models/$cage/surface.obj?level=2"
  cp answer refined.obj
  upload refined.obj
  refined=$id
  http POST "/v1/models/$refined/coarsen"
  expect 201
  holds '.levels == 2 and (.meshes[0] | .vertices == 297 and .faces == 288 and .uv_sets == 1)'
  get "/v1/models/$(value .id)/surface.obj?level=2"
  diff <(grep ^f refined.obj) <(grep ^f answer)
  paste -d ' ' <(grep '^vt\? ' refined.obj) <(grep '^vt\? ' answer) | awk '
    { for (i = 2; i <= NF / 2; i++) { d = $i - $(i + NF / 2); if (d * d > 1e-10) { print; exit 1 } } }'
  http POST "/v1/models/$refined/coarsen?levels=1"
  expect 201
  holds '.levels == 1 and .meshes[0].faces == 1152'
}

@test "a refined mesh gives back a cage whose crease turns" {
  printf %s '{"meshes": [{"shape": {"kind": "box", "size": [2, 2, 2], "segments": [2, 1, 1]},
    "edits": [{"edit": "crease", "edges": [[0, 1]], "sharpness": 10}]}]}' >creased.json
  upload creased.json
  cage=$id
  for level in 1 2 3; do # at level 2 the crease turns by 63 degrees, as a line with a corner does
    get "/v1/models/$cage/surface.obj?level=$level"
    cp answer refined.obj
    upload refined.obj
    http POST "/v1/models/$id/coarsen"
    holds ".levels == $level and (.meshes[0] | .faces == 10 and .creases == 1 and .corners == 0 and .details == [])"
  done
}

@test "what has no cage says so, and stores nothing" {
  upload "$samples/octopus.obj"
  get /v1/models
  before=$(value '.models | length')
  http POST "/v1/models/$id/coarsen"
  expect 422
  holds '.detail | contains("no refinement")'
  for query in levels=0 levels=17 levels=-1 levels=most scheme=cubic level=1; do
    http POST "/v1/models/$id/coarsen?$query"
    expect 400
  done
  http POST "/v1/models/$id/coarsen?levels=most"
  holds '.detail | contains("max, or 1 to 16")'
  for query in mesh=head scheme=bilinear scheme=loop boundary=open; do
    http POST "/v1/models/$id/coarsen?$query"
    expect 422
  done
  get /v1/models
  [ "$(value '.models | length')" = "$before" ]
}

@test "what the surface of a cage misses is kept as detail" {
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.obj?level=2"
  awk '/^v / && ++n % 7 == 0 { $2 += 0.1 } 1' answer >dented.obj
  upload dented.obj
  http POST "/v1/models/$id/coarsen"
  expect 201
  holds '.levels == 2 and (.meshes[0] | .faces == 288 and .details == [2])'
  get "/v1/models/$(value .id)/surface.obj?level=2"
  paste -d ' ' <(grep '^v ' dented.obj | cut -d ' ' -f 1-4) <(grep '^v ' answer) | awk '
    { for (i = 2; i <= 4; i++) { d = $i - $(i + 4); if (d * d > 1e-10) { print; exit 1 } } }'
}
