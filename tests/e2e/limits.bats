# Limits: what is too much is refused, on the headers where they tell, and with the numbers.

load helper
setup_file() {
  [[ -z ${TESTED_URL-} ]] || return 0
  start_daemon --max-upload 100000 --max-faces 100000
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

@test "a model just under the limit is taken" {
  { cat "$samples/cube.obj"; head -c 99000 /dev/zero | tr '\0' '\n'; } >filled.obj
  post /v1/models filled.obj
  expect 201
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

@test "the daemon is well after all of it" {
  get /readyz
  expect 200
}
