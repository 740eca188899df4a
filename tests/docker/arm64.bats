# The image for arm64, run by an emulator that is mounted into it.

image=${TWEEND_IMAGE:-tweend:test-arm64}

setup() { name=tweend-arm64-$$; }
teardown() { docker rm --force --volumes "$name" >/dev/null 2>&1 || true; }

@test "it says that it is arm64's" {
  [ "$(docker image inspect --format '{{.Architecture}}' "$image")" = arm64 ]
}

@test "it starts under an emulator, is healthy, answers, and has the page" {
  docker run --detach --name "$name" --read-only --cap-drop ALL --security-opt no-new-privileges --volume /data \
    --publish 127.0.0.1::8080 --volume "$(command -v qemu-aarch64-static):/emulator:ro" --entrypoint /emulator \
    "$image" /usr/bin/tweend >/dev/null
  url=http://$(docker port "$name" 8080/tcp | head -n 1)
  for _ in $(seq 100); do
    ! curl --silent --fail --output /dev/null "$url/readyz" || break
    sleep 0.2
  done
  docker exec "$name" /emulator /usr/bin/tweend --healthcheck
  curl --silent --fail --data-binary "@$BATS_TEST_DIRNAME/../../server/samples/cube.obj" --header 'Content-Type: model/obj' \
    --output "$BATS_TEST_TMPDIR/cube.glb" "$url/v1/surface.glb?level=2"
  [ "$(head --bytes 4 "$BATS_TEST_TMPDIR/cube.glb")" = glTF ]
  curl --silent "$url/" | grep -q '<script type="module">'
}
