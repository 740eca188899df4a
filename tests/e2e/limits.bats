# Limits: what is too much is refused, on the headers where they tell, and with the numbers.

load helper
setup_file() {
  [[ -z ${TWEEND_URL-} ]] || return 0
  start_daemon --max-upload 100000 --max-level 6 --max-faces 100000 --max-output 3000000 --max-times 1000
}
teardown_file() { stop_daemon; }
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
}

@test "an upload over the limit is refused on its headers: not a byte of it is sent" {
  head -c 5000000 /dev/zero >large
  status=$(curl --silent --output answer --dump-header headers --write-out '%{http_code} %{size_upload}' \
    --data-binary @large --header 'Content-Type: model/obj' --header 'Expect: 100-continue' \
    --expect100-timeout 10 "$url/v1/models")
  [ "${status##* }" = 0 ]
  status=${status%% *}
  problem 413 100000
}

@test "curl that does not wait gets the answer too" {
  head -c 5000000 /dev/zero >large
  http POST /v1/models --data-binary @large --header 'Content-Type: model/obj' --header 'Expect:'
  problem 413
}

@test "a body that does not tell its length is cut off at the limit" {
  head -c 5000000 /dev/zero >large
  http POST /v1/models --data-binary @large --header 'Content-Type: model/obj' --header 'Transfer-Encoding: chunked' --header 'Expect:'
  problem 413
}

@test "a model just under the limit is taken" {
  { cat "$samples/cube.obj"; head -c 99000 /dev/zero | tr '\0' '\n'; } >filled.obj
  post /v1/models filled.obj
  expect 201
}

@test "a packed body is measured unpacked" {
  { cat "$samples/cube.obj"; head -c 50000000 /dev/zero | tr '\0' '\n'; } | gzip -9 >bomb.gz
  [ "$(stat -c %s bomb.gz)" -lt 100000 ]
  post /v1/models bomb.gz --header 'Content-Encoding: gzip'
  problem 413
}

@test "a level over the limit is refused by its name" {
  upload "$samples/cube.obj"
  get "/v1/models/$id/surface.glb?level=7"
  [[ $status == 400 || $status == 422 ]]
  problem "$status" '6'
}

@test "faces over the limit are refused with the number there would be" {
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.glb?level=5"
  # 288 * 4^5 = 294912
  problem 422 294912
  get "/v1/models/$id/surface.json?level=5"
  [[ $status == 200 || $status == 422 ]]
  grep -q 294912 answer
}

@test "bytes over the limit are refused with the number there would be" {
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.json?level=4"
  bytes=$(value '.bytes // empty')
  get "/v1/models/$id/surface.glb?level=4"
  problem 422 "${bytes:-[0-9]{7}}"
}

@test "times over the limit are refused, in a query and in a body" {
  upload "$samples/tank.json"
  get "/v1/models/$id/pose.json?from=0&to=100&fps=100"
  problem 422 1000
  jq -n '{times: [range(1001) / 500]}' >times.json
  http POST "/v1/models/$id/pose" --data-binary @times.json --header 'Content-Type: application/json'
  problem 422 1000
}

# many COUNT: opens so many connections that say nothing, in this shell.
many() {
  local i host port
  IFS=: read -r host port <<<"${url#http://}"
  held=()
  for ((i = 0; i < $1; i++)); do
    exec {fd}<>"/dev/tcp/$host/$port" || break
    held+=("$fd")
  done
}

release() {
  for fd in "${held[@]}"; do exec {fd}>&-; done
}

@test "health checks are answered at --max-connections, and others told to come again" {
  start_daemon --max-connections 20
  many 60
  for path in /healthz /readyz /healthz; do
    get "$path"
    expect 200
  done
  get /version
  expect 503
  release
  stop_daemon
}

@test "out of descriptors it rests, says so once a second, and goes on afterwards" {
  start_daemon
  prlimit --pid "$daemon" --nofile=24:24
  many 40
  sleep 2.5
  logged=$(grep -c 'cannot accept' "$log")
  release
  echo "$logged lines"
  ((logged >= 1 && logged <= 4))
  get /healthz
  expect 200
  stop_daemon
}

@test "the daemon is well after all of it" {
  get /readyz
  expect 200
}
