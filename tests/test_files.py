from curvematch_jax._files import short


def test_what_a_damaged_file_makes_an_error_say_is_one_printable_line():
    text = short(TypeError("no keyword 'chun\ufeffk'\n\x1b[31m" + "x" * 1000))
    assert text.startswith("TypeError: no keyword 'chun?k' ?[31mxxx")
    assert text.isprintable()
    assert len(text) < 200
