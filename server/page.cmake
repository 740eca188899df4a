# Writes a C file that holds the page, and OUTPUT.whole when the page could be built:
#   cmake -DSOURCE=server/page -DFOLDER=build/page -DOUTPUT=page.c -P page.cmake
# FOLDER receives the packages, so that nothing is written beside the sources. They are installed again only when the
# lock file changes. Without npm, or when the packages cannot be fetched, the page says what is missing; since
# OUTPUT.whole is missing then, the next build tries again.
find_program(NPM npm)
find_program(NODE node)
set(missing "")
file(REMOVE "${OUTPUT}.whole")
file(MAKE_DIRECTORY "${FOLDER}")

if(NOT NPM OR NOT NODE)
  set(missing "npm and node were not found")
else()
  foreach(name package.json package-lock.json)
    file(COPY_FILE "${SOURCE}/${name}" "${FOLDER}/${name}" ONLY_IF_DIFFERENT)
  endforeach()
  if("${FOLDER}/package-lock.json" IS_NEWER_THAN "${FOLDER}/node_modules/.package-lock.json")
    execute_process(
      COMMAND "${NPM}" ci --prefix "${FOLDER}" --ignore-scripts --prefer-offline --fetch-retries=1 --no-audit --no-fund
      RESULT_VARIABLE status OUTPUT_VARIABLE said ERROR_VARIABLE said)
    if(NOT status EQUAL 0)
      file(REMOVE_RECURSE "${FOLDER}/node_modules")
      message("${said}")
      set(missing "npm could not install the packages of server/page")
    endif()
  endif()
endif()

if(missing)
  message(WARNING "the daemon has no page: ${missing}")
  set(html "${FOLDER}/missing.html")
  configure_file("${SOURCE}/missing.html" "${html}" @ONLY)
  set(policy "default-src 'none'; img-src data:; frame-ancestors 'self'")
else()
  execute_process(COMMAND "${NODE}" "${SOURCE}/build.mjs" "${FOLDER}" COMMAND_ERROR_IS_FATAL ANY)
  set(html "${FOLDER}/page.html")
  file(READ "${FOLDER}/page.policy" policy)
  file(WRITE "${OUTPUT}.whole" "")
endif()

execute_process(COMMAND gzip -9 -n -c "${html}" OUTPUT_FILE "${html}.gz" COMMAND_ERROR_IS_FATAL ANY)
file(SHA256 "${html}" hash)
file(READ "${html}.gz" hex HEX)
string(REGEX REPLACE "(................................)" "\\1\n" hex "${hex}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
file(WRITE "${OUTPUT}" "#include \"page.h\"\nconst unsigned char srv_page[] = {\n${bytes}\n};\n"
  "const size_t srv_page_size = sizeof srv_page;\nconst char srv_page_hash[] = \"${hash}\";\n"
  "const char srv_page_policy[] = \"${policy}\";\n")
