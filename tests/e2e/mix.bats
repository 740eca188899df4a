#!/usr/bin/env bats
# Mixed clips: layers of this model and of others, in every request that takes a clip.

load helper

setup_file() { start_daemon; }
teardown_file() { stop_daemon; }

# turn NODE DEGREES [SECONDS]: a track about y, from 0.
turn() {
  printf '{"node":"%s","path":"rotation","times":[0,%s],"axis_angles":[[0,1,0,0],[0,1,0,%s]],"unit":"degrees"}' "$1" "${3:-1}" "$2"
}

# model CLIPS: stores a figure of three nodes with these clips; prints its id.
model() {
  printf '{"nodes":[{"name":"hips"},{"name":"spine","parent":"hips"},{"name":"head","parent":"spine"}],"clips":[%s]}' "$1" |
    curl --silent --show-error --fail-with-body --data-binary @- -H 'Content-Type: application/json' "$url/v1/models" | gojq -r .id
}

# refused CLIPS: status, pointer and detail of an upload that is refused.
refused() {
  printf '{"nodes":[{"name":"hips"},{"name":"spine","parent":"hips"}],"clips":[%s]}' "$1" |
    curl --silent --data-binary @- -H 'Content-Type: application/json' "$url/v1/models" |
    gojq -r '"\(.status) \(.errors[0].pointer) \(.errors[0].detail)"'
}

# yaw NODE QUERY MODEL: the angle about y in degrees, rounded.
yaw() {
  curl --silent --fail-with-body "$url/v1/models/$3/pose.json?as=euler&order=YXZ&unit=degrees&nodes=$1&$2" |
    gojq -c '[.poses[].euler[0][1] * 1000 | round / 1000]'
}

clips="{\"name\":\"walk\",\"tracks\":[$(turn hips 90),$(turn spine 40)]},{\"name\":\"run\",\"tracks\":[$(turn hips 30)]},
  {\"name\":\"nod\",\"tracks\":[$(turn head 20),$(turn spine 10)]}"

@test "layers are blended by their weights, where they move a node" {
  id=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"walk\",\"weight\":3},{\"clip\":\"run\",\"weight\":1}]}")
  [[ $(yaw hips 'clip=stroll&at=1' "$id") == '[75.26'* ]] # the normalised sum of 3 x 90 and 30 degrees, not their mean of 75
  [[ $(yaw spine 'clip=stroll&at=1' "$id") == '[40]' ]]
}

@test "additive layers come on top, weighted, masked and in order" {
  id=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"walk\"},{\"clip\":\"nod\",\"mode\":\"additive\",\"weight\":0.5},
    {\"clip\":\"nod\",\"mode\":\"additive\",\"nodes\":[\"head\"],\"reference\":0.5}]}")
  [[ $(yaw spine 'clip=stroll&at=1' "$id") == '[45]' ]]
  [[ $(yaw head 'clip=stroll&at=1,0.5' "$id") == '[20,5]' ]]
}

@test "weights of 0 and 1 leave clips untouched to the last bit, in all forms" {
  id=$(model "$clips,{\"name\":\"solo\",\"layers\":[{\"clip\":\"run\",\"weight\":0},{\"clip\":\"walk\"},
    {\"clip\":\"nod\",\"mode\":\"additive\",\"weight\":{\"times\":[0,1],\"values\":[0,0]}}]}")
  for form in json ndjson bin csv; do
    for query in 'from=0&to=1&fps=130&space=world' 'from=0&to=3&fps=13&loop=pingpong' 'at=0.3&as=matrix'; do
      cmp <(curl --silent --fail "$url/v1/models/$id/pose.$form?clip=walk&$query") \
        <(curl --silent --fail "$url/v1/models/$id/pose.$form?clip=solo&$query" | sed 's/"clip":"solo"/"clip":"walk"/')
    done
  done
}

@test "a keyed weight fades from one clip to another, and the duration covers both" {
  id=$(model "{\"name\":\"walk\",\"tracks\":[$(turn hips 60 2)]},{\"name\":\"run\",\"tracks\":[$(turn hips 20 2)]},{\"name\":\"fade\",\"layers\":[
    {\"clip\":\"walk\",\"weight\":{\"times\":[1,2],\"values\":[1,0]}},
    {\"clip\":\"run\",\"offset\":-1,\"weight\":{\"times\":[1,2],\"values\":[0,1]}}]}")
  [[ $(yaw hips 'clip=fade&at=1,2,3,9' "$id") == '[30,10,20,20]' ]]
  [[ $(curl --silent "$url/v1/models/$id/pose.json?clip=fade" | gojq .duration) == 3 ]]
}

@test "sync stretches layers to one phase" {
  id=$(model "{\"name\":\"walk\",\"tracks\":[$(turn hips 60 2)]},{\"name\":\"run\",\"tracks\":[$(turn hips 20 1)]},{\"name\":\"jog\",\"layers\":[
    {\"clip\":\"walk\",\"sync\":true},{\"clip\":\"run\",\"sync\":true}]}")
  # rates 0.5 and 1 rounds a second make 0.75; the mean of equal weights of 60 and 20 degrees is 40
  [[ $(curl --silent "$url/v1/models/$id/pose.json?clip=jog" | gojq '.duration * 3 | round') == 4 ]]
  [[ $(yaw hips 'clip=jog&at=0.66666667,1.3333334' "$id") == '[20,40]' ]]
}

@test "layers are borrowed, and mixed clips are borrowed like any other" {
  lender=$(model "{\"name\":\"a/b,c\",\"tracks\":[$(turn hips 50),$(turn tail 50 3)]}" 2>/dev/null) || true
  lender=$(model "{\"name\":\"a/b,c\",\"tracks\":[$(turn hips 50)]}")
  id=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"$lender/a/b,c\"}]},
    {\"name\":\"more\",\"layers\":[{\"clip\":\"stroll\"},{\"clip\":\"nod\",\"mode\":\"additive\"}]}")
  other=$(printf '{"nodes":[{"name":"head"},{"name":"hips"}]}' |
    curl --silent --data-binary @- -H 'Content-Type: application/json' "$url/v1/models" | gojq -r .id)
  [[ $(yaw hips "clip=$id/more&at=1" "$other") == '[50]' ]]
  [[ $(yaw head "clip=$id/more&at=1" "$other") == '[20]' ]]
  curl --silent "$url/v1/models/$other/pose.json?clip=$id/more" | gojq -e '.warnings == ["the clip moves a node that the model does not have: spine"]'
  [[ $(yaw hips "clip=run,$id/stroll&at=1" "$id") == '[50]' ]]
  [[ $(yaw hips "clip=$id/stroll,run&at=1" "$id") == '[30]' ]]
}

@test "a lender that is gone is 404 with the layer's place, not an answer of the cache" {
  lender=$(model "{\"name\":\"gone\",\"tracks\":[$(turn hips 51)]}")
  id=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"walk\"},{\"clip\":\"$lender/gone\"}]}")
  query="$url/v1/models/$id/pose.json?clip=stroll"
  etag=$(curl --silent --head --fail "$query" | sed -n 's/^ETag: //Ip' | tr -d '\r')
  [[ $(curl --silent -H "If-None-Match: $etag" -o /dev/null -w '%{http_code}' "$query") == 304 ]]
  curl --silent --fail -X DELETE "$url/v1/models/$lender"
  curl --silent "$query" | gojq -e '.status == 404 and .errors[0].pointer == "/clips/3/layers/1/clip" and
    (.detail | contains("stroll") and contains("layer 1"))'
  missing=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"$id/trot\"}]}")
  curl --silent "$url/v1/models/$missing/pose.json?clip=stroll" |
    gojq -e '.status == 404 and (.detail | contains("no clip of model") and contains("is called \"trot\"") and contains("walk"))'
}

@test "a file of all clips lacks those whose lender is gone, and has them again when it is back" {
  local lent
  lent="{\"name\":\"lent\",\"tracks\":[$(turn hips 52)]}"
  lender=$(model "$lent")
  id=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"$lender/lent\"}]},{\"name\":\"jog\",\"layers\":[{\"clip\":\"run\"}]}")
  ask() { curl --silent --dump-header "$BATS_TEST_TMPDIR/headers" "$url/v1/models/$id/surface.gltf?level=0$1"; }
  header() { sed -n "s/^$1: //Ip" "$BATS_TEST_TMPDIR/headers" | tr -d '\r'; }
  [[ $(ask '' | gojq -c '[.animations[].name]') == '["walk","run","nod","stroll","jog"]' ]]
  whole=$(header ETag)
  [[ $(header Cache-Control) == *immutable ]]
  curl --silent --fail -X DELETE "$url/v1/models/$lender"
  [[ $(ask '' | gojq -c '[.animations[].name]') == '["walk","run","nod","jog"]' ]]
  [[ $(header ETag) != "$whole" && $(header Cache-Control) == no-cache ]]
  [[ $(header X-Tweend-Warning) == *the%20mixed%20clip%20stroll%20is%20left%20out* ]]
  part=$(header ETag)
  levels() { curl --silent --dump-header "$BATS_TEST_TMPDIR/headers" --output /dev/null "$url/v1/models/$id/levels.json"; }
  levels
  [[ $(header Cache-Control) == no-cache ]]
  few=$(header ETag)
  [[ $(curl --silent -H "If-None-Match: $part" -o /dev/null -w '%{http_code}' "$url/v1/models/$id/surface.gltf?level=0") == 304 ]]
  [[ $(ask '&clip=stroll' | gojq .status) == 404 ]]
  [[ $(ask '&clip=walk,stroll' | gojq .status) == 404 ]]
  [[ $(model "$lent") == "$lender" ]]
  levels
  [[ $(header ETag) != "$few" && $(header Cache-Control) == *immutable ]]
  [[ $(ask '' | gojq '.animations | length') == 5 && $(header ETag) == "$whole" ]]
}

@test "what cannot be mixed is refused by its place" {
  local mixed='{"name":"m","layers":'
  walk="{\"name\":\"walk\",\"tracks\":[$(turn hips 1)]}"
  [[ $(refused "$walk,${mixed}[{\"clip\":\"wlak\"}]}") == '422 /clips/1/layers/0/clip no clip is called "wlak"; did you mean walk?' ]]
  [[ $(refused "{\"name\":\"a\",\"layers\":[{\"clip\":\"b\"}]},{\"name\":\"b\",\"layers\":[{\"clip\":\"a\"}]}") == \
    '422 /clips/1/layers/0/clip clip "a" is mixed of itself' ]]
  [[ $(refused "${mixed}[{\"clip\":\"m\"}]}") == '422 /clips/0/layers/0/clip clip "m" is mixed of itself' ]]
  [[ $(refused "${mixed}[]}") == '422 /clips/0/layers '* ]]
  [[ $(refused "${mixed}[{}]}") == '400 /clips/0/layers/0 '* ]]
  refused_layer() { refused "$walk,${mixed}[{\"clip\":\"walk\",$1}]}"; }
  [[ $(refused_layer '"weight":-1') == '422 /clips/1/layers/0/weight '* ]]
  [[ $(refused_layer '"weight":"1"') == '400 /clips/1/layers/0/weight '* ]]
  [[ $(refused_layer '"weight":{"times":[0,0],"values":[1,1]}') == '422 /clips/1/layers/0/weight/times/1 '* ]]
  [[ $(refused_layer '"weight":{"times":[0,1],"values":[1]}') == '422 /clips/1/layers/0/weight/values '* ]]
  [[ $(refused_layer '"speed":0,"sync":true') == '422 /clips/1/layers/0/speed '* ]]
  [[ $(refused_layer '"nodes":["spien"]') == '422 /clips/1/layers/0/nodes/0 '*spine* ]]
  [[ $(refused_layer '"nodes":[]') == '422 /clips/1/layers/0/nodes '* ]]
  [[ $(refused_layer '"reference":1') == '400 /clips/1/layers/0/reference '* ]]
  [[ $(refused_layer '"sync":true,"loop":"repeat"') == '400 /clips/1/layers/0/loop '* ]]
  [[ $(refused_layer '"wait":1') == '400 /clips/1/layers/0 unknown member'* ]]
  [[ $(refused_layer '"retarget":"auto"') == '400 /clips/1/layers/0/retarget '* ]]
  [[ $(refused_layer '"map":{"a":"hips"}') == '400 /clips/1/layers/0/map map goes with retarget auto' ]]
  [[ $(refused_layer '"retarget":"auto","feet":"stand"') == '400 /clips/1/layers/0/feet '* ]]
  [[ $(refused_layer '"retarget":"auto","map":{"a":1}') == '400 /clips/1/layers/0/map/a '* ]]
  [[ $(refused "$walk,{\"name\":\"m\",\"tracks\":[],\"layers\":[{\"clip\":\"walk\"}]}") == '400 /clips/1/layers '* ]]
}

@test "clips that lie too deep, or are too many, are refused" {
  chain="{\"name\":\"c0\",\"tracks\":[$(turn hips 1)]}" wide="{\"name\":\"w0\",\"tracks\":[$(turn hips 1)]}"
  for i in 1 2 3 4 5 6 7 8; do
    chain+=",{\"name\":\"c$i\",\"layers\":[{\"clip\":\"c$((i - 1))\"}]}"
  done
  id=$(model "$chain")
  [[ $(yaw hips 'clip=c8&at=1' "$id") == '[1]' ]]
  [[ $(refused "$chain,{\"name\":\"c9\",\"layers\":[{\"clip\":\"c8\"}]}") == '422 /clips/9/layers/0/clip '*deep ]]
  for i in 1 2 3; do
    wide+=",{\"name\":\"w$i\",\"layers\":[$(printf '{"clip":"w%d"},' $((i - 1)){,,,,,,} | sed 's/,$//')]}"
  done
  [[ $(refused "$wide") == '422 /clips/3/layers/5/clip '*'256 clips' ]]
}

@test "live and BVH play mixed clips" {
  id=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"walk\",\"weight\":1},{\"clip\":\"nod\",\"mode\":\"additive\"}]}")
  last=$(curl --silent --max-time 5 "$url/v1/models/$id/live?clip=stroll&fps=20&speed=4&as=euler&order=YXZ&unit=degrees" |
    sed -n 's/^data: //p' | grep euler | tail -n 1)
  [[ $(gojq -c '[.euler[][1] | round]' <<<"$last") == '[90,50,20]' ]]
  [[ $(curl --silent --fail "$url/v1/models/$id/pose.bvh?clip=stroll&fps=1" | tail -n 1 | tr ' ' '\n' | grep -cE '^(90|50|20)$') == 3 ]]
}

@test "a description tells the layers, and a duration where the model's own clips make it" {
  lender=$(model "{\"name\":\"far\",\"tracks\":[$(turn hips 52 4)]}")
  id=$(model "$clips,{\"name\":\"slow\",\"layers\":[{\"clip\":\"walk\",\"speed\":0.5},{\"clip\":\"nod\",\"mode\":\"additive\"}]},
    {\"name\":\"lent\",\"layers\":[{\"clip\":\"$lender/far\"}]}")
  curl --silent "$url/v1/models/$id" | gojq -e --arg lent "$lender/far" '.clips[3:] ==
    [{"name":"slow","duration":2,"tracks":0,"keys":0,"layers":[{"clip":"walk","mode":"replace"},{"clip":"nod","mode":"additive"}]},
     {"name":"lent","duration":null,"tracks":0,"keys":0,"layers":[{"clip":$lent,"mode":"replace"}]}]'
  [[ $(curl --silent "$url/v1/models/$id/pose.json?clip=lent" | gojq .duration) == 4 ]]
}

# keys GLB NAME: the key times of each channel of an animation of a GLB that is read from standard input as glTF.
channels() {
  gojq -c --arg name "$1" '.accessors as $a | .animations[] | select(.name == $name) |
    [.channels[] as $c | {path: $c.target.path, keys: $a[.samplers[$c.sampler].input].count}]'
}

@test "a surface holds keys that follow mixed clips, within the tolerance" {
  id=$(model "$clips,{\"name\":\"fade\",\"layers\":[{\"clip\":\"walk\",\"weight\":{\"times\":[0,1],\"values\":[1,0]}},{\"clip\":\"run\",\"weight\":{\"times\":[0,1],\"values\":[0,1]}}]}")
  curl --silent --fail -D "$BATS_TEST_TMPDIR/head" "$url/v1/models/$id/surface.gltf?clip=fade" >"$BATS_TEST_TMPDIR/fade.gltf"
  channels fade <"$BATS_TEST_TMPDIR/fade.gltf" | gojq -e 'length == 2 and all(.keys >= 2)'
  grep -qi '^X-Tweend-Error: degrees=0.0' "$BATS_TEST_TMPDIR/head"
  # what is played from these keys is what is posed
  made=$(curl --silent --fail --data-binary @"$BATS_TEST_TMPDIR/fade.gltf" -H 'Content-Type: model/gltf+json' "$url/v1/models" | gojq -r .id)
  query='from=0&to=1&fps=40'
  paste <(yaw hips "clip=fade&$query" "$id" | tr ',' '\n' | tr -d '[]') <(yaw hips "clip=fade&$query" "$made" | tr ',' '\n' | tr -d '[]') |
    awk '{ d = $1 - $2; if (d > 0.1 || d < -0.1) exit 1; n++ } END { exit n != 41 }'
  fewer=$(curl --silent --fail "$url/v1/models/$id/surface.gltf?clip=fade&tolerance=5" | channels fade | gojq '[.[].keys] | add')
  [[ $fewer -lt $(channels fade <"$BATS_TEST_TMPDIR/fade.gltf" | gojq '[.[].keys] | add') ]]
  # beside others, and baked
  curl --silent --fail "$url/v1/models/$id/surface.gltf" | gojq -e '[.animations[].name] == ["walk","run","nod","fade"]'
  curl --silent --fail "$url/v1/models/$id/surface.gltf?clip=fade&at=0,0.5,1" | channels fade | gojq -e 'all(.keys == 3)'
  curl --silent --fail "$url/v1/models/$id/surface.glb?clip=fade&from=0&to=1&fps=10" -o /dev/null
}

@test "tracks inspects the keys of a mixed clip" {
  id=$(model "$clips,{\"name\":\"stroll\",\"layers\":[{\"clip\":\"walk\",\"weight\":1},{\"clip\":\"nod\",\"mode\":\"additive\"}]}")
  curl --silent --fail "$url/v1/models/$id/tracks?clip=stroll" | gojq -e '.clip == "stroll" and
    ([.tracks[] | {node, degrees: (.total_degrees | round)}] ==
      [{"node":"hips","degrees":90},{"node":"spine","degrees":50},{"node":"head","degrees":20}]) and .report.root.node == "hips"'
  # Another model borrows it with the same keys, and the same report.
  other=$(model "$clips")
  curl --silent --fail "$url/v1/models/$other/tracks?clip=$id/stroll" | gojq -e --argjson own "$(curl --silent "$url/v1/models/$id/tracks?clip=stroll")" \
    '.tracks == $own.tracks and .report == $own.report'
}

@test "a layer is carried over to the skeleton, and so is a mixed clip" {
  # Two skeletons of one shape whose bones have other names: a rotation of hips is that of Hips.
  figure() {
    printf '{"nodes":[{"name":"%s"},{"name":"%s","parent":"%s","translation":[0,0.2,0]},{"name":"%s","parent":"%s","translation":[0,0.5,0]}],"clips":[%s]}' \
      "$1" "$2" "$1" "$3" "$2" "$4" |
      curl --silent --show-error --fail-with-body --data-binary @- -H 'Content-Type: application/json' "$url/v1/models" | gojq -r .id
  }
  lender=$(figure mixamorig:Hips mixamorig:Spine mixamorig:Head \
    "{\"name\":\"turn\",\"tracks\":[$(turn mixamorig:Hips 40)]},{\"name\":\"half\",\"layers\":[{\"clip\":\"turn\",\"speed\":0.5}]}")
  id=$(figure hips spine head "{\"name\":\"a\",\"tracks\":[$(turn spine 30)]},{\"name\":\"both\",\"layers\":[{\"clip\":\"a\"},
    {\"clip\":\"$lender/turn\",\"retarget\":\"auto\"}]},{\"name\":\"deep\",\"layers\":[{\"clip\":\"$lender/half\",\"retarget\":\"auto\"}]}")
  [[ $(yaw hips 'clip=both&at=1' "$id") == '[40]' ]]
  [[ $(yaw spine 'clip=both&at=1' "$id") == '[30]' ]]
  [[ $(yaw hips 'clip=deep&at=1,2' "$id") == '[20,40]' ]]
  [[ $(yaw hips "clip=$lender/half&retarget=auto&at=1,2" "$id") == '[20,40]' ]]
  curl --silent --fail "$url/v1/models/$id/tracks?clip=$lender/half&retarget=auto" | gojq -e '.retarget.bones | length == 3'
  for wide in '' '&tolerance=1'; do
    curl --silent --fail "$url/v1/models/$id/surface.gltf?level=0&clip=$lender/half&retarget=auto$wide" >"$BATS_TEST_TMPDIR/half.gltf"
    gojq -e '[.animations[0].channels[].target] == [{"node": 0, "path": "rotation"}]' "$BATS_TEST_TMPDIR/half.gltf"
    lent=$(curl --silent --fail --data-binary "@$BATS_TEST_TMPDIR/half.gltf" -H 'Content-Type: model/gltf+json' "$url/v1/models" | gojq -r .id)
    [[ $(yaw hips 'at=1,2' "$lent") == '[20,40]' ]]
  done
  [[ $(refused "{\"name\":\"w\",\"tracks\":[$(turn hips 1)]},{\"name\":\"m\",\"layers\":[{\"clip\":\"w\",\"retarget\":\"auto\"}]}") == \
    '400 /clips/1/layers/0/retarget '* ]]
  other=$(printf '{"nodes":[{"name":"stone"}],"clips":[{"name":"c","layers":[{"clip":"%s/turn","retarget":"auto"}]}]}' "$lender" |
    curl --silent --data-binary @- -H 'Content-Type: application/json' "$url/v1/models" | gojq -r .id)
  curl --silent "$url/v1/models/$other/pose.json?clip=c" | gojq -e '.status == 422 and (.detail | startswith("clip \"c\", layer 0: "))'
}

@test "edits store mixed clips as keys, and say so" {
  lender=$(model "{\"name\":\"gone\",\"tracks\":[$(turn hips 53)]}")
  id=$(printf '{"meshes":[{"name":"m","shape":{"kind":"box"}}],"nodes":[{"name":"hips","mesh":"m"}],"clips":[%s,
    {"name":"slow","layers":[{"clip":"walk","speed":0.5}]},{"name":"lost","layers":[{"clip":"%s/gone"}]}]}' \
    "{\"name\":\"walk\",\"tracks\":[$(turn hips 60)]}" "$lender" |
    curl --silent --fail --data-binary @- -H 'Content-Type: application/json' "$url/v1/models" | gojq -r .id)
  curl --silent --fail -X DELETE "$url/v1/models/$lender"
  made=$(curl --silent --fail -D "$BATS_TEST_TMPDIR/head" --data '{"edits":[{"edit":"subdivide","faces":"all"}]}' \
    -H 'Content-Type: application/json' "$url/v1/models/$id/edits" | gojq -r .id)
  curl --silent "$url/v1/models/$made" | gojq -e '[.clips[] | {name, duration}] == [{"name":"walk","duration":1},{"name":"slow","duration":2}]'
  grep -i '^X-Tweend-Warning' "$BATS_TEST_TMPDIR/head" | grep -q 'slow%20is%20stored%20as%20keys'
  [[ $(yaw hips 'clip=slow&at=1' "$made") == '[30]' ]]
}

@test "layers that cannot do what they seem to ask for are told" {
  id=$(model "$clips,{\"name\":\"idle\",\"layers\":[{\"clip\":\"run\",\"nodes\":[\"head\"]},{\"clip\":\"run\",\"offset\":1},
    {\"clip\":\"run\",\"speed\":-1},{\"clip\":\"run\",\"mode\":\"additive\",\"reference\":2},{\"clip\":\"run\",\"speed\":-1,\"offset\":1},
    {\"clip\":\"run\",\"offset\":1,\"loop\":\"repeat\"},{\"clip\":\"run\",\"speed\":0,\"offset\":1},{\"clip\":\"inner\",\"nodes\":[\"head\"]}]},
    {\"name\":\"inner\",\"layers\":[{\"clip\":\"walk\",\"nodes\":[\"hips\"]},{\"clip\":\"nod\"}]}")
  curl --silent --fail-with-body "$url/v1/models/$id/pose.json?clip=idle&at=0" | gojq -r '.warnings[]' | diff - <(
    echo 'clip "idle", layer 0 moves nothing: its clip moves none of its nodes'
    echo 'clip "idle", layer 1 stands still: from its offset on its clip is at its end'
    echo 'clip "idle", layer 2 stands still: backwards from its offset its clip is at its start'
    echo 'clip "idle", layer 3 has its reference behind the end of its clip: it is the last pose'
  )
}
