"""``ice explore``: a page on which camera and lights are dragged around an object and the predicted precision answers.

The page is one of our own, drawn with the browser's 2-D canvas and served by aiohttp. viser 1.1, made for such pages,
was tried first: it shades its meshes, so that a colour no longer says its number; where there is no GPU its page took
10 to 20 s to appear; it checks neither who connects nor from which page, and offers any visitor a tunnel through its
makers' server; and it needs rich below 15.

`state` is what one visitor looks at; `answers`, `sphere`, `preview`, `effects` and `best` are functions of scene and
state; `prove` renders and measures, `save` writes; `session` is a visitor's connection; `server` and `gate` let them
in.
"""
