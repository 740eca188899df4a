# Keys with rights and rates, signed URLs, and what pages of other origins may do.

load helper

setup() { cd "$BATS_TEST_TMPDIR" || return; }
teardown() { stop_daemon; }

as() { printf 'Authorization: Bearer %s' "$1"; }

# signature METHOD PATH QUERY KEY: of the contract's form, by openssl.
signature() {
  printf '%s\n%s\n%s' "$1" "$2" "$3" | openssl dgst -sha256 -hmac "$4" -binary | base64 -w 0 | tr '+/' '-_' | tr -d =
}

start_with_rights() {
  needs_process
  cat >keys <<'END'
# who may what
all
reader read
writer write
remover delete
slow read 3/m
END
  printf 'rose\nold\n' >url-keys
  start_daemon --api-keys "@$PWD/keys" --url-keys "@$PWD/url-keys"
}

@test "a key does what it has the right to, and nothing else" {
  start_with_rights
  post /v1/models "$samples/cube.obj" --header "$(as reader)"
  problem 403 write
  post /v1/models "$samples/cube.obj" --header "$(as writer)"
  expect 201
  [[ $(header cache-control) == private* ]]
  id=$(jq -r .id answer)
  get "/v1/models/$id/surface.glb" --header "$(as writer)"
  problem 403 read
  get "/v1/models/$id/surface.glb" --header "X-API-Key: reader"
  expect 200
  [[ $(header cache-control) == private,* && $(header vary) == *Authorization* ]]
  get /metrics
  problem 401
  get /metrics --header "$(as reader)"
  expect 200
  http DELETE "/v1/models/$id" --header "$(as reader)"
  problem 403 delete
  http DELETE "/v1/models/$id" --header "$(as remover)"
  expect 204
  for open in /healthz /readyz /version /openapi.json; do
    get "$open"
    expect 200
    [[ $(header cache-control) != private* ]]
  done
}

@test "a signed URL is read without a key until its time is over" {
  start_with_rights
  post /v1/models "$samples/tank.json" --header "$(as all)"
  id=$(jq -r .id answer)
  path=/v1/models/$id/pose.json
  exp=$(($(date +%s) + 600))
  for key in rose old; do
    sig=$(signature GET "$path" "at=0.5%2C1&clip=drive&exp=$exp&nodes=barrel" "$key")
    get "$path?clip=drive&nodes=barrel&at=0.5,1&exp=$exp&sig=$sig"
    expect 200
    http HEAD "$path?clip=drive&nodes=barrel&at=0.5,1&exp=$exp&sig=$sig"
    expect 200
    get "$path?clip=drive&nodes=barrel&at=0.5,2&exp=$exp&sig=$sig"
    problem 403 signature
    get "$path?clip=drive&nodes=barrel&at=0.5,1&exp=$((exp + 1))&sig=$sig"
    problem 403 signature
  done
  past=$(($(date +%s) - 1))
  get "$path?exp=$past&sig=$(signature GET "$path" "exp=$past" rose)"
  problem 403 over
  http DELETE "/v1/models/$id?exp=$exp&sig=$(signature DELETE "/v1/models/$id" "exp=$exp" rose)"
  problem 401
}

@test "the daemon signs URLs for whoever may read" {
  start_with_rights
  order='{"url": "/v1/models?limit=1", "seconds": 60}'
  post /v1/sign <(printf %s "$order")
  problem 401
  post /v1/sign <(printf %s "$order") --header "$(as writer)"
  problem 403
  post /v1/sign <(printf %s "$order") --header "$(as reader)"
  expect 200
  signed=$(value .url)
  [[ $signed == "/v1/models?limit=1&exp="*"&sig="* ]]
  get "$signed"
  expect 200
  get "${signed/limit=1/limit=2}"
  problem 403
  post /v1/sign <(printf '{"url": "/v1/models", "seconds": 604801}') --header "$(as reader)"
  problem 422 'seven days'
}

@test "SIGHUP takes over other rights and other keys for URLs" {
  start_with_rights
  exp=$(($(date +%s) + 600))
  signed="/v1/models?exp=$exp&sig=$(signature GET /v1/models "exp=$exp" old)"
  get "$signed"
  expect 200
  echo rose >url-keys
  echo 'reader write' >keys
  kill -HUP "$daemon"
  for ((tries = 0; tries < 100; tries++)); do
    get "$signed"
    [[ $status == 200 ]] || break
    sleep 0.1
  done
  problem 403
  get /v1/models --header "$(as reader)"
  problem 403 read
  echo 'reader reed' >keys
  kill -HUP "$daemon"
  for ((tries = 0; tries < 100; tries++)); do
    ! grep -q 'line 1 is not KEY' "$log" || break
    sleep 0.1
  done
  grep -q 'the API keys stay' "$log"
}

@test "a key over its rate is 429 with the time to come back" {
  start_with_rights
  for left in 2 1 0; do
    get /v1/models --header "$(as slow)"
    expect 200
    [[ $(header ratelimit-policy) == '"key";q=3;w=60' && $(header ratelimit) == "\"key\";r=$left;t="* ]]
  done
  get /v1/models --header "$(as slow)"
  problem 429
  (($(header retry-after) >= 1 && $(header retry-after) <= 20))
  get /v1/models --header "$(as reader)"
  expect 200
  [[ -z $(header ratelimit) ]]
  get /healthz --header "$(as slow)"
  expect 200
}

@test "pages of other origins neither list nor delete, unless they are named" {
  needs_process
  start_daemon
  far='Origin: https://far.example'
  post /v1/models "$samples/cube.obj" --header "$far"
  expect 201
  [[ $(header access-control-allow-origin) == '*' && $(header timing-allow-origin) == '*' ]]
  id=$(jq -r .id answer)
  get "/v1/models/$id" --header "$far"
  expect 200
  [[ $(header access-control-allow-origin) == '*' ]]
  get /v1/models --header "$far"
  problem 403
  [[ -z $(header access-control-allow-origin) ]]
  http DELETE "/v1/models/$id" --header "$far"
  problem 403
  http OPTIONS "/v1/models/$id" --header "$far" --header 'Access-Control-Request-Method: DELETE'
  expect 204
  [[ $(header access-control-allow-methods) != *DELETE* ]]
  get /v1/models --header "Origin: $url"
  expect 200
  stop_daemon
  start_daemon --cors-origins https://far.example
  get /v1/models --header "$far"
  expect 200
  [[ $(header access-control-allow-origin) == https://far.example ]]
  http DELETE "/v1/models/$id" --header "$far"
  expect 204
}
