# The disk fills up, and turns read-only, under a running daemon. On a file system of its own, in a mount namespace.

load helper
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
  mkdir -p data
  unshare --mount mount -t tmpfs tmpfs data 2>/dev/null || skip "no file system can be mounted here"
  # shellcheck disable=SC2016 # the inner shell expands
  launch unshare --mount sh -c 'mount -t tmpfs -o size=6m tmpfs "$1" && exec "$2" --listen 127.0.0.1:0 --data "$1"' \
    sh "$PWD/data" "${TESTED_BINARY:-$root/build/tweend}"
}
teardown() { [[ -z ${daemon-} ]] || stop_daemon; }

# model NUMBER BYTES: one of its own.
model() {
  cat "$samples/cube.obj"
  echo "# $1"
  head -c "$2" /dev/zero | tr '\0' '\n'
}

remount() { nsenter --target "$daemon" --mount mount -o "remount,$1" "$PWD/data"; }

# becomes STATUS: /readyz, within some seconds.
becomes() {
  for _ in $(seq 100); do
    get /readyz
    [[ $status != "$1" ]] || return 0
    pause 0.1
  done
  expect "$1"
}

@test "a full disk is 507, serves what is there, and takes models again when there is room" {
  local stored=() n refusals=0
  for n in {1..20}; do
    model "$n" 600000 >model.obj
    post /v1/models model.obj
    if [[ $status == 201 ]]; then
      stored+=("$(value .id)")
    else
      problem 507
      refusals=$((refusals + 1))
    fi
  done
  ((${#stored[@]} >= 5 && refusals >= 5))
  # A body that is spooled does not fit either.
  model long 4000000 >model.obj
  post /v1/models model.obj
  problem 507
  for one in "${stored[@]}"; do
    get "/v1/models/$one/source"
    expect 200
    [ "$(sha256sum answer | head -c 32)" = "$one" ]
    get "/v1/models/$one/surface.json"
    expect 200
  done
  get '/v1/models?limit=1000'
  holds ".models | length == ${#stored[@]}"
  for one in "${stored[@]:0:4}"; do
    http DELETE "/v1/models/$one"
    expect 204
  done
  becomes 200
  model again 600000 >model.obj
  post /v1/models model.obj
  expect 201
}

@test "a disk that turns read-only serves what is there, says so, and takes models again afterwards" {
  upload "$samples/cube.obj"
  remount ro
  becomes 503
  model 1 10 >model.obj
  post /v1/models model.obj
  problem 503
  [[ $(header retry-after) =~ ^[0-9]+$ ]]
  http DELETE "/v1/models/$id"
  problem 503
  get "/v1/models/$id/source"
  expect 200
  cmp answer "$samples/cube.obj"
  get "/v1/models/$id/surface.glb?level=3"
  expect 200
  post "/v1/surface.obj" "$samples/cube.obj"
  expect 200
  get /healthz
  expect 200
  remount rw
  becomes 200
  post /v1/models model.obj
  expect 201
}
