// Where pictures go, and that a place that cannot take them is named before any is drawn.
#include "client/output.h"

// clang-format off
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define WIDTH  16
#define HEIGHT 12

static char folder[64];

static const char* path_in(const char* name)
{
    static char path[400];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int make_folder(void** state)
{
    (void)state;
    strcpy(folder, P_tmpdir "/test_output.XXXXXX");
    return mkdtemp(folder) == NULL;
}

static int drop_folder(void** state)
{
    (void)state;
    char command[100];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

static Image grey(uint8_t level)
{
    Image image;
    Fault fault = {""};
    assert_true(image_create(&image, WIDTH, HEIGHT, &fault));
    memset(image.rgba, level, WIDTH * HEIGHT * 4);
    return image;
}

static Output* must_open(const char* path)
{
    Fault fault = {""};
    Output* output = output_open(path, WIDTH, HEIGHT, 30.0, &fault);
    if (output == NULL) fail_msg("%s", fault.text);
    return output;
}

static void put(Output* output, uint8_t level)
{
    Fault fault = {""};
    Image image = grey(level);
    if (!output_picture(output, &image, &fault)) fail_msg("%s", fault.text);
    image_free(&image);
}

static void must_close(Output* output)
{
    Fault fault = {""};
    if (!output_close(output, &fault)) fail_msg("%s", fault.text);
}

static void assert_picture(const char* name, uint8_t level)
{
    Image image;
    Fault fault = {""};
    if (!image_read_png(&image, path_in(name), &fault)) fail_msg("%s", fault.text);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    assert_int_equal(image.rgba[0], level);
    image_free(&image);
}

static int files_in(const char* path)
{
    DIR* directory = opendir(path);
    assert_non_null(directory);
    int count = 0;
    while (readdir(directory) != NULL)
        ++count;
    closedir(directory);
    return count - 2; // . and ..
}

static void png_keeps_the_last_picture(void** state)
{
    (void)state;
    Output* output = must_open(path_in("last.png"));
    put(output, 10);
    put(output, 20);
    assert_int_equal(output_count(output), 2);
    must_close(output);
    assert_picture("last.png", 20);
}

static void png_of_no_picture_is_not_written(void** state)
{
    (void)state;
    must_close(must_open(path_in("none.png")));
    assert_int_not_equal(access(path_in("none.png"), F_OK), 0);
}

static void directory_is_made_and_its_files_are_numbered(void** state)
{
    (void)state;
    Output* output = must_open(path_in("film//"));
    for (int i = 0; i < 3; ++i)
        put(output, (uint8_t)(30 + i));
    must_close(output);
    assert_picture("film/00000.png", 30);
    assert_picture("film/00001.png", 31);
    assert_picture("film/00002.png", 32);
    assert_int_equal(files_in(path_in("film")), 3);
    // One that is there already is fine.
    output = must_open(path_in("film"));
    put(output, 99);
    must_close(output);
    assert_picture("film/00000.png", 99);
    assert_picture("film/00001.png", 31);
}

static void mp4_is_a_film(void** state)
{
    (void)state;
    if (system("ffmpeg -version > /dev/null 2>&1") != 0) {
        printf("SKIPPED: no ffmpeg\n");
        skip();
    }
    Output* output = must_open(path_in("film.mp4"));
    for (int i = 0; i < 3; ++i)
        put(output, (uint8_t)(60 * i));
    must_close(output);
    char start[8] = {0};
    FILE* file = fopen(path_in("film.mp4"), "rb");
    assert_non_null(file);
    assert_int_equal(fread(start, 1, 8, file), 8);
    fclose(file);
    assert_memory_equal(start + 4, "ftyp", 4);
}

static void nothing_is_kept_without_a_path(void** state)
{
    (void)state;
    Output* output = must_open(NULL);
    put(output, 1);
    assert_int_equal(output_count(output), 1);
    must_close(output);
    must_close(NULL);
}

static void keep_notice(void* context, const char* text)
{
    snprintf(context, 400, "%s", text);
}

static void pictures_of_a_longer_earlier_run_are_told(void** state)
{
    (void)state;
    char said[400] = "";
    Notice notice = {keep_notice, said};
    for (int pictures = 3; pictures >= 2; --pictures) {
        Output* output = must_open(path_in("again"));
        for (int i = 0; i < pictures; ++i)
            put(output, (uint8_t)(10 * pictures + i));
        output_tell_older(output, &notice);
        must_close(output);
        if (pictures == 3) assert_string_equal(said, "");
    }
    assert_non_null(strstr(said, "again/00002.png"));
    assert_picture("again/00001.png", 21);
    assert_picture("again/00002.png", 32); // told, not removed
}

static void what_is_abandoned_leaves_the_earlier_file(void** state)
{
    (void)state;
    static const char* const names[] = {"kept.png", "kept.mp4"};
    bool has_ffmpeg = system("ffmpeg -version > /dev/null 2>&1") == 0;
    for (size_t i = 0; i < (has_ffmpeg ? 2 : 1); ++i) {
        int before = files_in(folder);
        FILE* file = fopen(path_in(names[i]), "w");
        assert_non_null(file);
        assert_int_equal(fputs("kept", file) < 0, 0);
        fclose(file);
        Output* output = must_open(path_in(names[i]));
        put(output, 1);
        output_abandon(output);
        char text[8] = "";
        file = fopen(path_in(names[i]), "r");
        assert_non_null(fgets(text, sizeof text, file));
        fclose(file);
        assert_string_equal(text, "kept");
        assert_int_equal(files_in(folder), before + 1);
    }
    output_abandon(NULL);
}

// Refused at once, in one line that names the option and holds `words`.
static void expect_refused(const char* path, const char* words)
{
    Fault fault = {""};
    Output* output = output_open(path, WIDTH, HEIGHT, 30.0, &fault);
    if (output != NULL) {
        output_close(output, NULL);
        fail_msg("%s was taken", path);
    }
    if (strstr(fault.text, "--out") == NULL || strstr(fault.text, words) == NULL ||
        strchr(fault.text, '\n') != NULL)
        fail_msg("%s: \"%s\"", path, fault.text);
}

static void places_that_do_not_exist_are_refused_at_once(void** state)
{
    (void)state;
    expect_refused(path_in("nowhere/a.png"), "nowhere: No such file or directory");
    expect_refused(path_in("nowhere/a.mp4"), "nowhere: No such file or directory");
    expect_refused(path_in("nowhere/a"), "No such file or directory");
    expect_refused("", "");
}

static void endings_are_read_in_any_case_and_unknown_ones_are_refused(void** state)
{
    (void)state;
    Output* output = must_open(path_in("loud.PNG"));
    put(output, 7);
    must_close(output);
    assert_picture("loud.PNG", 7);
    static const char* const unknown[] = {"a.tiff", "a.jpg", ".png", "sub/.mp4", ".hidden"};
    for (size_t i = 0; i < sizeof unknown / sizeof *unknown; ++i) {
        expect_refused(path_in(unknown[i]), "ends with /");
        assert_int_not_equal(access(path_in(unknown[i]), F_OK), 0);
    }
    expect_refused("-", "choose");
    // Meant as a directory: there already, or said so.
    output = must_open(path_in("run.1/"));
    put(output, 8);
    must_close(output);
    must_close(must_open(path_in("run.1")));
    assert_picture("run.1/00000.png", 8);
}

static void files_in_the_place_of_directories_are_refused_at_once(void** state)
{
    (void)state;
    FILE* file = fopen(path_in("plain"), "w");
    assert_non_null(file);
    fclose(file);
    expect_refused(path_in("plain"), "exists and is not a directory");
    expect_refused(path_in("plain/a"), "Not a directory");
    expect_refused(path_in("plain/a.png"), "Not a directory");
    assert_int_equal(mkdir(path_in("folder.png"), 0777), 0);
    expect_refused(path_in("folder.png"), "is a directory");
    assert_int_equal(mkdir(path_in("folder.mp4"), 0777), 0);
    expect_refused(path_in("folder.mp4"), "is a directory");
}

// Root may write wherever a mode says; nobody may make files in /proc.
static void places_that_take_no_files_are_refused_at_once(void** state)
{
    (void)state;
    if (access("/proc/self", F_OK) != 0) skip();
    expect_refused("/proc/a.png", "/proc");
    expect_refused("/proc/a.mp4", "/proc");
    expect_refused("/proc/a", "/proc/a");
    expect_refused("/proc/self", "/proc/self");
}

static void paths_too_long_are_refused(void** state)
{
    (void)state;
    char path[3000];
    memset(path, 'a', sizeof path);
    strcpy(path + sizeof path - 5, ".png");
    expect_refused(path, "longer than 1023");
}

static void trying_a_place_leaves_nothing_there(void** state)
{
    (void)state;
    assert_int_equal(mkdir(path_in("clean"), 0777), 0);
    must_close(must_open(path_in("clean/a.png")));
    must_close(must_open(path_in("clean")));
    assert_int_equal(files_in(path_in("clean")), 0);
}

static void fault_at_the_end_is_told(void** state)
{
    (void)state;
    Fault fault = {""};
    assert_int_equal(mkdir(path_in("gone"), 0777), 0);
    Output* output = must_open(path_in("gone/a.png"));
    put(output, 1);
    assert_int_equal(rmdir(path_in("gone")), 0);
    assert_false(output_close(output, &fault));
    assert_non_null(strstr(fault.text, "gone/a.png"));

    output = must_open(path_in("going"));
    assert_int_equal(rmdir(path_in("going")), 0);
    Image image = grey(1);
    assert_false(output_picture(output, &image, &fault));
    assert_non_null(strstr(fault.text, "going/00000.png"));
    image_free(&image);
    must_close(output);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(png_keeps_the_last_picture),
        cmocka_unit_test(png_of_no_picture_is_not_written),
        cmocka_unit_test(directory_is_made_and_its_files_are_numbered),
        cmocka_unit_test(mp4_is_a_film),
        cmocka_unit_test(pictures_of_a_longer_earlier_run_are_told),
        cmocka_unit_test(what_is_abandoned_leaves_the_earlier_file),
        cmocka_unit_test(endings_are_read_in_any_case_and_unknown_ones_are_refused),
        cmocka_unit_test(nothing_is_kept_without_a_path),
        cmocka_unit_test(places_that_do_not_exist_are_refused_at_once),
        cmocka_unit_test(files_in_the_place_of_directories_are_refused_at_once),
        cmocka_unit_test(places_that_take_no_files_are_refused_at_once),
        cmocka_unit_test(paths_too_long_are_refused),
        cmocka_unit_test(trying_a_place_leaves_nothing_there),
        cmocka_unit_test(fault_at_the_end_is_told),
    };
    return cmocka_run_group_tests(tests, make_folder, drop_folder);
}
