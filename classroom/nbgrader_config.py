"""Settings of nbgrader for this course: run its commands in this folder."""

c = get_config()  # noqa: F821 - nbgrader provides it

c.CourseDirectory.course_id = "spectral-geometry"

# Stubs that do not raise: an untouched copy runs from top to bottom, and each check says that nothing was attempted.
c.ClearSolutions.code_stub = {"python": "# your code here\n..."}
c.ClearSolutions.text_stub = "*Your answer here.*"

c.Execute.timeout = 300  # seconds a cell
c.LimitOutput.max_lines = 200
