"""From the documents of the repository to a site.

documents  Markdown files -> pages, with links that lead within the site
reference  pages made from registries, the command line and the tables
models     pages of the models, each with the picture of a trial
api        pages made from docstrings
gallery    figures of the published studies, with few trials and their verdicts
blocks     the code blocks of a page, and how they are run
publisher  persons and addresses of pyproject.toml -> the documents that state them
site       all of it together, and Sphinx
"""
